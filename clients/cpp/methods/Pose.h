double x() const { return position[0]; }  ///< @return m
double y() const { return position[1]; }  ///< @return m
double heading() const;  ///< @return rad, counter-clockwise from the world's x axis, in (-pi, pi]
/// @return base_link in the world
Transform transform() const { return {position, orientation}; }
/// @param later another one
/// @param at us, between the two
/// @return the pose of that moment
[[nodiscard]] Pose interpolated(const Pose& later, int64_t at) const;
