// What came of a request to change or read a world: an answer, or why it is refused.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "ruedo/reply_t.hpp"

namespace ruedo::engine {

struct Outcome {
  int32_t code = reply_t::OK;
  std::string text;  // what went wrong
  std::vector<uint8_t> body;
  int64_t after_step = -1;  // answer when this state was published; -1: at once
  bool pending =
      false;  // what is asked for is being made ready: Control::finish() brings the outcome
  bool quiet = false;  // the reply goes out only if the request is repeated

  static Outcome refuse(int32_t code, std::string text) { return {code, std::move(text), {}}; }
  static Outcome with(std::vector<uint8_t> body) { return {reply_t::OK, {}, std::move(body)}; }
  static Outcome after(int64_t step) { return {reply_t::OK, {}, {}, step}; }
  static Outcome later() {
    Outcome outcome;
    outcome.pending = true;
    return outcome;
  }
};

template <class Message>
std::vector<uint8_t> encoded(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace ruedo::engine
