/// @return theta in [-pi, pi), rad
double heading() const { return normalize_angle(theta); }
/// @return base_link in odom
Transform transform() const { return Transform::of(x, y, theta); }
/// @param later another one
/// @param at us, between the two
/// @return the odometry of that moment
[[nodiscard]] Odometry interpolated(const Odometry& later, int64_t at) const;
