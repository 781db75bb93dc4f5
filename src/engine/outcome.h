// The result of a request: an answer, or the reason for a refusal.
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
  int64_t after_step = -1;  // answered once this state is published; -1: at once
  bool pending = false;     // still being prepared: Control::finish() supplies the outcome
  bool quiet = false;       // the reply is only sent if the request is repeated

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
