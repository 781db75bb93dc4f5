// The names of the simulation's own channels, before --remap. Those of records, which are in logs
// alone, are in log/header.h.
#pragma once

namespace ruedo {

inline constexpr const char* kTickChannel = "ruedo/tick";
inline constexpr const char* kInfoChannel = "ruedo/info";
inline constexpr const char* kWorldChannel = "ruedo/world";
inline constexpr const char* kRequestChannel = "ruedo/request";
inline constexpr const char* kReplyChannel = "ruedo/reply";
inline constexpr const char* kMarkersChannel = "ruedo/markers";

}  // namespace ruedo
