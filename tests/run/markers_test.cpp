// Drawings of clients are checked before they are accepted, displace no robot's command, and are
// in the batch for the log.
#include "engine/markers.h"

#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "engine/command_inbox.h"

namespace ruedo::engine {
namespace {

marker_t marker_of(int8_t kind) {
  marker_t marker{};
  marker.kind = kind;
  marker.orientation[0] = 1.0;
  for (float& part : marker.color) part = 1.0f;
  marker.size = 0.1f;
  return marker;
}

markers_t layer_with(marker_t marker) {
  markers_t markers{};
  markers.layer = "plan";
  markers.n = 1;
  markers.markers.push_back(std::move(marker));
  return markers;
}

TEST(Markers, AcceptsCompleteMarkers) {
  marker_t path = marker_of(marker_t::PATH);
  path.n = 2;
  path.points = {{0, 0, 0}, {1, 0, 0}};
  marker_t map = marker_of(marker_t::MAP);
  map.columns = 2;
  map.ncells = 4;
  map.cells = {0, 100, 255, 50};
  marker_t text = marker_of(marker_t::TEXT);
  text.text = "ziel äöü";
  for (const marker_t& marker : {path, map, text}) EXPECT_EQ(check_markers(layer_with(marker)), "");
  markers_t none{};
  none.layer = "plan";
  EXPECT_EQ(check_markers(none), "");
}

TEST(Markers, ReportsEachFault) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    std::function<void(markers_t&)> spoil;
    const char* why;
  };
  const Case cases[] = {
      {[](markers_t& m) { m.layer = ""; }, "layer is a name of 1 to 63 bytes, UTF-8"},
      {[](markers_t& m) { m.layer = std::string(64, 'x'); },
       "layer is a name of 1 to 63 bytes, UTF-8"},
      {[](markers_t& m) { m.layer = "\xff"; }, "layer is a name of 1 to 63 bytes, UTF-8"},
      {[](markers_t& m) { m.frame = std::string(64, 'x'); },
       "frame is a robot's name of at most 63 bytes, UTF-8"},
      {[](markers_t& m) { m.markers.resize(1001, m.markers[0]); },
       "1001 markers, 1000 are allowed"},
      {[](markers_t& m) { m.markers[0].kind = 9; }, "marker 0: there is no kind 9"},
      {[](markers_t& m) { m.markers[0].size = 0; },
       "marker 0: size 0 m is not above 0 and at most 1000 m"},
      {[](markers_t& m) { m.markers[0].color[3] = 1.5f; },
       "marker 0: color 1.5 is not from 0 to 1"},
      {[](markers_t& m) { m.markers[0].orientation[0] = 0.0; },
       "marker 0: orientation is not a unit quaternion w, x, y, z"},
      {[](markers_t& m) { m.markers[0].position[1] = kNan; },
       "marker 0: position nan is not within 1e+06 m"},
      {[](markers_t& m) { m.markers[0].points = {{0, 0, static_cast<float>(kNan)}}; },
       "marker 0: point nan is not within 1e+06 m"},
      {[](markers_t& m) { m.markers[0].n = 3; }, "marker 0: 3 points do not make pairs"},
      {[](markers_t& m) {
         m.markers[0].kind = marker_t::TEXT;
         m.markers[0].text = std::string(1001, 'x');
       },
       "marker 0: text has 1001 bytes, 1000 are allowed"},
      {[](markers_t& m) {
         m.markers[0].kind = marker_t::MAP;
         m.markers[0].columns = 2;
         m.markers[0].ncells = 3;
       },
       "marker 0: 3 cells do not fill rows of 2 columns"},
      {[](markers_t& m) {
         m.markers[0].kind = marker_t::MAP;
         m.markers[0].columns = m.markers[0].ncells = 1;
         m.markers[0].cells = {101};
       },
       "marker 0: cell 101 is not from 0 to 100, or 255"},
  };
  for (const Case& each : cases) {
    markers_t markers = layer_with(marker_of(marker_t::LINES));
    each.spoil(markers);
    EXPECT_EQ(check_markers(markers), each.why);
  }
}

std::vector<uint8_t> bytes_of(const markers_t& markers) {
  std::vector<uint8_t> bytes(static_cast<size_t>(markers.getEncodedSize()));
  markers.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

TEST(Markers, TheInboxAcceptsOnlyCompleteMarkers) {
  CommandInbox inbox({{"ruedo/markers", RobotIndex(), Input::Kind::markers}}, 0);
  markers_t markers = layer_with(marker_of(marker_t::POINTS));
  const auto good = bytes_of(markers);
  inbox.put("ruedo/markers", good.data(), good.size());
  EXPECT_EQ(inbox.refused(), 0u);
  markers.markers[0].size = -1;
  const auto bad = bytes_of(markers);
  inbox.put("ruedo/markers", bad.data(), bad.size());
  EXPECT_EQ(inbox.refused(), 1u);
  EXPECT_EQ(inbox.schedule(3, InputIndex(0), bad.data(), bad.size()),
            CommandInbox::Scheduled::faulty);
  EXPECT_EQ(inbox.schedule(3, InputIndex(0), good.data(), good.size()),
            CommandInbox::Scheduled::kept);
  for (size_t i = 0; i < CommandInbox::kKeptOfWorld; ++i)
    inbox.put("ruedo/markers", good.data(), good.size());
  EXPECT_EQ(inbox.displaced(), 1u);  // the oldest of them, no robot's command
}

}  // namespace
}  // namespace ruedo::engine
