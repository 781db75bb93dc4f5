/// Writes a JPEG's bytes as they are, rgb, bgr and gray as PPM or PGM.
/// @param path of the file
/// @throws Error for another format, and for what cannot be written
void save(const std::string& path) const;
