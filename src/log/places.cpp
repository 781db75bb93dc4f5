#include "log/places.h"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "ruedo/errors.h"

namespace ruedo::log {
namespace {

constexpr size_t kReadAtOnce = 64;  // by a cursor

[[noreturn]] void fail(const std::string& what) {
  throw EnvironmentError("the temporary file of a log's index " + what + ": " +
                         std::strerror(errno) + " (its folder: $TMPDIR, else /var/tmp)");
}

// Not in /tmp, which is memory on many machines.
FileHandle nameless_file() {
  const char* chosen = std::getenv("TMPDIR");
  const std::string first = chosen && *chosen ? chosen : "/var/tmp";
  for (const std::string& folder : {first, std::filesystem::temp_directory_path().string()}) {
    std::string name = folder + "/ruedo-index-XXXXXX";
    FileHandle file(::mkostemp(name.data(), O_CLOEXEC));
    if (!file) continue;
    ::unlink(name.c_str());
    return file;
  }
  fail("cannot be made");
}

}  // namespace

int64_t PlacesFile::append(std::span<const Place> places) {
  if (!file_) file_ = nameless_file();
  if (write_all(file_.get(), places.data(), places.size_bytes()) != places.size_bytes())
    fail("cannot be written");
  const int64_t at = size_;
  size_ += static_cast<int64_t>(places.size_bytes());
  return at;
}

void PlacesFile::read(int64_t at, std::span<Place> places) const {
  auto* bytes = reinterpret_cast<char*>(places.data());
  for (size_t left = places.size_bytes(); left > 0;) {
    const ssize_t got = ::pread(file_.get(), bytes, left, at);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) fail("cannot be read");
    bytes += got;
    at += got;
    left -= static_cast<size_t>(got);
  }
}

void Places::push_back(const Place& place) {
  last_.push_back(place);
  if (last_.size() < page_) return;
  pages_.push_back({last_.front().time_us, file_->append(last_)});
  last_.clear();
}

void Places::read(size_t i, size_t most, std::vector<Place>& places) const {
  const size_t page = i / page_, in_page = i % page_;
  if (page == pages_.size()) {
    places.assign(last_.begin() + static_cast<ptrdiff_t>(in_page), last_.end());
    return;
  }
  places.resize(std::min(most, page_ - in_page));
  file_->read(pages_[page].at + static_cast<int64_t>(in_page * sizeof(Place)), places);
}

Place Places::operator[](size_t i) const {
  const size_t page = i / page_, in_page = i % page_;
  if (page == pages_.size()) return last_[in_page];
  Place place;
  file_->read(pages_[page].at + static_cast<int64_t>(in_page * sizeof(Place)), {&place, 1});
  return place;
}

size_t Places::count_until(SimTime time_us) const {
  // The last page that begins at that time or before; with equal times, those after it count, too.
  const auto after =
      std::upper_bound(pages_.begin(), pages_.end(), time_us,
                       [](SimTime time, const Page& page) { return time < page.begin_us; });
  const bool in_last = after == pages_.end() && !last_.empty() && last_.front().time_us <= time_us;
  if (after == pages_.begin() && !in_last) return 0;
  const size_t begin = page_ * static_cast<size_t>(after - pages_.begin() - (in_last ? 0 : 1));
  std::vector<Place> places;
  read(begin, page_, places);
  return begin +
         static_cast<size_t>(std::ranges::upper_bound(places, time_us, {}, &Place::time_us) -
                             places.begin());
}

const Place* Places::Cursor::next() {
  if (next_ == read_.size()) {
    begin_ += read_.size();
    next_ = 0;
    if (begin_ == places_->size()) return nullptr;
    places_->read(begin_, kReadAtOnce, read_);
  }
  return &read_[next_++];
}

}  // namespace ruedo::log
