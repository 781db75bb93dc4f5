/// @param origin another fix, usually the first
/// @return m to the east, to the north and upwards of it, on the plane that touches the WGS 84
/// ellipsoid's parallel surface there
[[nodiscard]] Vector3 enu(const NavSat& origin) const;
