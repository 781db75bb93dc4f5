// The file consists of the page (kShell, made by build.mjs), a JSON index, and all bytes as one
// base64 text.
#include "console/log_page.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include <fmt/format.h>

#include "base/base64.h"
#include "base/channel_names.h"
#include "base/json.h"
#include "base/lcm_log.h"
#include "base/utf8.h"
#include "console/assets.h"
#include "console/board.h"
#include "console/events.h"
#include "console/scene_data.h"
#include "console/types.h"
#include "log/index.h"
#include "log/reader.h"
#include "ruedo/errors.h"
#include "ruedo/image_t.hpp"
#include "ruedo/markers_t.hpp"
#include "ruedo/world_info_t.hpp"
#include "system/output_file.h"

namespace ruedo::console {
namespace {

constexpr uint32_t kMostMessage = 16u << 20;  // bytes; larger messages are left out
constexpr SimTime kFirstInterval_us = 20'000;
constexpr size_t kHead = 16;  // bytes before an entry's messages: channel, count, time

template <class Value>
void append(std::vector<uint8_t>& bytes, Value value) {  // little endian, as in browsers
  const auto* from = reinterpret_cast<const uint8_t*>(&value);
  bytes.insert(bytes.end(), from, from + sizeof value);
}

bool are_pictures(const log::Index::Channel& channel) {
  return channel.fingerprint == image_t::getHash();
}

// Calls keep(i, place) for each message of a channel that remains if there is one for each such
// interval, the first in it; always including the last.
template <class Keep>
void thin(const log::Index::Channel& channel, SimTime interval_us, Keep keep) {
  SimTime due_us = std::numeric_limits<SimTime>::min();
  log::Places::Cursor cursor(channel.places);
  for (size_t i = 0; const log::Place* place = cursor.next(); ++i) {
    const bool last = i + 1 == channel.places.size();
    if (place->size > kMostMessage || (place->time_us < due_us && !last)) continue;
    keep(i, *place);
    if (interval_us > 0) due_us = place->time_us - place->time_us % interval_us + interval_us;
  }
}

// Bytes of the page that messages take; the last of a channel may come with the parts before it.
size_t size_of(const log::Index& index, bool pictures, SimTime interval_us) {
  size_t sum = 0;
  for (const log::Index::Channel& channel : index.channels()) {
    if (are_pictures(channel) != pictures) continue;
    const size_t before = kLogHeadSize + channel.name.size();  // in the log
    const auto add = [&](size_t, const log::Place& place) {
      if (place.size <= kMostMessage) sum += kHead + sizeof(uint32_t) + place.size - before;
    };
    thin(channel, interval_us, add);
    const SimTime end_us = channel.places.back().time_us;
    for (size_t i = channel.places.size(); i-- > 0 && channel.places[i].time_us == end_us;)
      add(i, channel.places[i]);
  }
  return sum;
}

// The smallest interval for which they fit, to a hundredth; -1 if none fits.
SimTime interval_that_fits(const log::Index& index, bool pictures, size_t room) {
  const auto fits = [&](SimTime interval_us) {
    return size_of(index, pictures, interval_us) <= room;
  };
  if (fits(0)) return 0;
  const SimTime longest_us = 2 * (index.end_us() - index.begin_us() + kFirstInterval_us);
  SimTime fits_us = kFirstInterval_us;
  while (!fits(fits_us)) {
    if (fits_us > longest_us) return -1;
    fits_us *= 2;
  }
  for (SimTime low_us = fits_us / 2; fits_us - low_us > fits_us / 100 + 1;) {
    const SimTime middle_us = low_us + (fits_us - low_us) / 2;
    (fits(middle_us) ? fits_us : low_us) = middle_us;
  }
  return fits_us;
}

class Writer {
 public:
  Writer(const std::string& log, const run::LoadRun& load)
      : index_(log), worlds_(index_, load), reader_(log) {}

  LogPage write(const std::string& log, const std::string& path, size_t most_bytes) {
    LogPage page;
    page.fault = fault();
    add_scenes();
    EventScan scan(index_, worlds_.at(index_.begin_us()).world.get());
    scan.advance(reader_, std::numeric_limits<size_t>::max());
    add_events(scan.events());
    // Base64 encodes three bytes as four.
    const size_t fixed = kShellSize + json_scenes_.size() + json_events_.size() +
                         64 * index_.channels().size() + 4096;
    const size_t room = most_bytes > fixed ? (most_bytes - fixed) / 4 * 3 : 0;
    if (room <= bytes_.size()) {
      const size_t least = fixed + bytes_.size() / 3 * 4 + 100'000;
      throw InputError({log}, fmt::format("its scene alone needs a page of {:.1f} MB",
                                          static_cast<double>(least) * 1e-6));
    }
    const bool draws = !scan.drawn().layers().empty();
    const size_t left = (room - bytes_.size()) / 4 * (draws ? 3 : 4);
    SimTime pictures = interval_that_fits(index_, true, left / 2);
    const SimTime interval = interval_that_fits(
        index_, false, left - (pictures < 0 ? 0 : size_of(index_, true, pictures)));
    if (interval == 0)  // the pictures have what the others do not need
      pictures = interval_that_fits(index_, true, left - size_of(index_, false, 0));
    if (interval < 0)
      throw InputError(
          {log}, fmt::format(
                     "does not fit into a page of {:.1f} MB, however few of its messages are in it",
                     static_cast<double>(most_bytes) * 1e-6));
    const size_t messages_at = bytes_.size();
    add_messages(interval, pictures);
    add_drawn(scan.drawn(), left / 4);
    page.interval_s = static_cast<double>(interval) * 1e-6;
    page.pictures_s = static_cast<double>(pictures) * 1e-6;
    page.bytes = save(path, head(log, page, messages_at));
    return page;
  }

 private:
  std::string fault() const {
    const std::string damage =
        index_.fault().empty() ? "" : "The log is not whole: " + index_.fault() + ".";
    return damage + (damage.empty() || worlds_.fault().empty() ? "" : " ") + worlds_.fault();
  }

  void add_file(JsonWriter& json, const std::string& name, const std::vector<uint8_t>& bytes) {
    json.name(name)
        .open('[')
        .value(static_cast<int64_t>(bytes_.size()))
        .value(static_cast<int64_t>(bytes.size()))
        .close(']');
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }

  // Each scene of the run, with its start time.
  void add_scenes() {
    std::vector<SimTime> times{index_.begin_us()};
    for (const log::Index::Edit& edit : index_.edits()) times.push_back(edit.time_us);
    JsonWriter json;
    json.open('[');
    for (const SimTime time_us : times) {
      const run::LogWorlds::Scene& scene = worlds_.at(time_us);
      if (!scenes_.empty() && scenes_.back() == &scene) continue;
      scenes_.push_back(&scene);
      json.open('{')
          .member("from", static_cast<double>(scene.from_us) * 1e-6)
          .name("files")
          .open('{');
      const std::string types = types_json();
      add_file(json, "/types.json", {types.begin(), types.end()});
      if (scene.world) {
        const SceneData data(*scene.world, static_cast<int>(scenes_.size()));
        add_file(json, "/scene.json", *data.json);
        add_file(json, "/scene/meshes", *data.meshes);
        add_file(json, "/scene/links", *data.links);
        for (size_t i = 0; i < data.pictures.size(); ++i) {
          if (data.pictures[i].bytes)
            add_file(json, "/scene/textures/" + std::to_string(i), *data.pictures[i].bytes);
        }
      }
      json.close('}').close('}');
    }
    json_scenes_ = json.close(']').text();
    bytes_.resize((bytes_.size() + 7) / 8 * 8);
  }

  void add_events(const Events& events) {
    JsonWriter json;
    write_events(json, events.list());
    json_events_ = json.text();
  }

  // Each time with all that is drawn then. If there is not enough room, some are left out at even
  // distances.
  void add_drawn(const Drawn& drawn, size_t room) {
    std::set<SimTime> times;
    for (const Drawn::Layer& layer : drawn.layers()) {
      for (const Drawn::Mark& mark : layer.marks) times.insert(mark.time_us);
    }
    if (times.empty()) return;
    names_.emplace_back(kMarkersChannel);
    const std::vector<SimTime> all(times.begin(), times.end());
    const auto at = [&](SimTime time_us) {
      std::vector<std::vector<uint8_t>> messages;
      for (const Drawn::Layer& layer : drawn.layers())
        messages.push_back(Drawn::message(layer, layer.count_until(time_us), reader_));
      return messages;
    };
    size_t largest = 1;
    for (const auto& message : at(all.back())) largest += message.size() + 4;
    const size_t every = 1 + all.size() * largest / std::max<size_t>(room, 1);
    const auto channel = static_cast<uint32_t>(names_.size() - 1);
    add_entry(channel, index_.begin_us() - 1, at(index_.begin_us() - 1));
    for (size_t i = 0; i < all.size(); i += every) add_entry(channel, all[i], at(all[i]));
  }

  // Channel, number of messages (a message may come in parts), time in s; then each message's size
  // and bytes.
  void add_entry(uint32_t channel, SimTime time_us,
                 const std::vector<std::vector<uint8_t>>& messages) {
    append(bytes_, channel);
    append(bytes_, static_cast<uint32_t>(messages.size()));
    append(bytes_, static_cast<double>(time_us) * 1e-6);
    for (const std::vector<uint8_t>& message : messages) {
      append(bytes_, static_cast<uint32_t>(message.size()));
      bytes_.insert(bytes_.end(), message.begin(), message.end());
    }
  }

  void add_messages(SimTime interval_us, SimTime pictures_us) {
    for (size_t c = 0; c < index_.channels().size(); ++c) {
      const log::Index::Channel& channel = index_.channels()[c];
      names_.push_back(printable(channel.name));
      if (channel.fingerprint == world_info_t::getHash()) info_ = names_.back();
      const SimTime interval = are_pictures(channel) ? pictures_us : interval_us;
      if (interval < 0 || channel.fingerprint == markers_t::getHash()) continue;  // see add_drawn
      thin(channel, interval, [&](size_t i, const log::Place& place) {
        add_entry(static_cast<uint32_t>(c), place.time_us, whole(channel, i));
      });
    }
    if (!info_.empty()) return;
    info_ = kInfoChannel;
    names_.push_back(info_);
    for (const run::LogWorlds::Scene* scene : scenes_)
      add_entry(static_cast<uint32_t>(names_.size() - 1), scene->from_us, scene->info);
  }

  // A message with the preceding parts, if it is one of several.
  std::vector<std::vector<uint8_t>> whole(const log::Index::Channel& channel, size_t entry) {
    std::vector<std::vector<uint8_t>> parts;
    for (size_t i = entry + 1; i-- > 0 && parts.size() < Board::kMostParts;) {
      reader_.seek(channel.places[i].offset);
      if (!reader_.next(event_)) break;
      parts.insert(parts.begin(), event_.data);
      if (!Board::is_later_part(parts.front())) break;
    }
    return parts;
  }

  std::string head(const std::string& log, const LogPage& page, size_t messages_at) const {
    JsonWriter json;
    json.open('{')
        .member("title", printable(std::filesystem::path(log).filename().string()))
        .member("info", info_)
        .member("fault", printable(page.fault));
    json.member("begin", static_cast<double>(index_.begin_us()) * 1e-6)
        .member("end", static_cast<double>(index_.end_us()) * 1e-6);
    json.member("interval", page.interval_s)
        .member("pictures", page.pictures_s)
        .member("messages", static_cast<int64_t>(messages_at))
        .name("channels")
        .open('[');
    for (const std::string& name : names_) json.value(name);
    json.close(']').name("events").raw(json_events_).name("scenes").raw(json_scenes_).close('}');
    std::string text;
    // escaped, so that nothing in it ends the element that contains it
    for (const char c : json.text()) {
      if (c == '<') {
        text += "\\u003c";
      } else {
        text += c;
      }
    }
    return text;
  }

  size_t save(const std::string& path, const std::string& head) const {
    OutputFile file(path);
    size_t written = 0;
    const auto text = [&](std::string_view words) {
      file.write(words);
      written += words.size();
    };
    text({reinterpret_cast<const char*>(kShell), kShellSize});
    text("<script type=\"application/json\" id=\"log\">");
    text(head);
    text("</script>\n<script type=\"text/plain\" id=\"bytes\">");
    text(base64(bytes_));
    text("</script>\n</body>\n</html>\n");
    file.keep();
    return written;
  }

  log::Index index_;
  run::LogWorlds worlds_;
  log::Reader reader_;
  log::Event event_;
  std::vector<const run::LogWorlds::Scene*> scenes_;
  std::string json_scenes_, json_events_, info_;
  std::vector<std::string> names_;
  std::vector<uint8_t> bytes_;
};

}  // namespace

LogPage write_log_page(const std::string& log, const run::LoadRun& load, const std::string& path,
                       size_t most_bytes) {
  return Writer(log, load).write(log, path, most_bytes);
}

}  // namespace ruedo::console
