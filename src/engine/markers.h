// What clients draw, as it is checked before it is taken.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ruedo/markers_t.hpp"

namespace ruedo::engine {

// "" or what is wrong with it.
std::string check_markers(const markers_t& markers);

// What a client drew, of an encoded markers_t, or of the applied_t by which logs have it. nullopt:
// it is neither, or damaged, or what no run takes.
std::optional<markers_t> markers_in(std::span<const uint8_t> message);

// A cell's colour, of a map of that colour: free is clear, unknown grey.
std::array<float, 4> cell_color(uint8_t cell, const float* color);

// Cells of one value beside each other in a row, none of them clear.
struct CellRun {
  int32_t row, begin, end;  // columns, without `end`
  std::array<float, 4> color;
};
std::vector<CellRun> runs_of(const marker_t& map);

}  // namespace ruedo::engine
