/// @param ray from 0 on
/// @return rad, from the device's x axis towards y (left)
double angle(size_t ray) const { return angle_min + angle_step * static_cast<double>(ray); }
/// @param from_angle rad
/// @param to_angle rad
/// @return the smallest range between the two, m; +inf when nothing is there
[[nodiscard]] double nearest(double from_angle, double to_angle) const;
/// Where the rays ended, of those that returned.
/// @param device the pose of the device in a frame: `robot.lrf().transform()` for base_link's,
/// `robot.pose().at(scan.utime).transform() * robot.lrf().transform()` for the world's
/// @return m, in that frame
[[nodiscard]] std::vector<Vector3> points(const Transform& device = {}) const;
