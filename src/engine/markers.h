// Checks what clients draw before it is accepted.
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

// A client's drawing, from an encoded markers_t, or from the applied_t in which logs store it.
// nullopt: it is neither, damaged, or no run would accept it.
std::optional<markers_t> markers_in(std::span<const uint8_t> message);

// The colour of a cell in a map of that colour: free is transparent, unknown grey.
std::array<float, 4> cell_color(uint8_t cell, const float* color);

// Adjacent cells of equal value in a row, none of them transparent.
struct CellRun {
  int32_t row, begin, end;  // columns, excluding `end`
  std::array<float, 4> color;
};
std::vector<CellRun> runs_of(const marker_t& map);

}  // namespace ruedo::engine
