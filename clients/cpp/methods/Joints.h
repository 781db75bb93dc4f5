/// @param joint its name
/// @return where it is in the lists
/// @throws UnknownName, with the joints that there are
[[nodiscard]] size_t index(const std::string& joint) const;
/// @param joint its name
/// @return rad or m
/// @throws UnknownName, with the joints that there are
[[nodiscard]] double position(const std::string& joint) const;
/// @param joint its name
/// @return rad/s or m/s
/// @throws UnknownName, with the joints that there are
[[nodiscard]] double velocity(const std::string& joint) const;
/// @param joint its name
/// @return N m or N, of its motor
/// @throws UnknownName, with the joints that there are
[[nodiscard]] double effort(const std::string& joint) const;
