// Distinguishes a user's own files from others': a keyed hash (HMAC-SHA256) of this user alone.
//
// For files whose content cannot be checked value by value. The key is 32 random bytes in a file
// that only the user may read, ruedo/key in $XDG_STATE_HOME or else in ~/.local/state, made when
// first needed. If it cannot be stored, nothing is sealed.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace ruedo {

using Seal = std::array<uint8_t, 32>;

// Nothing without a key, if none can be made.
std::optional<Seal> seal_of(std::span<const uint8_t> bytes);

// Whether it is this user's seal of these bytes. Makes no key.
bool is_sealed(std::span<const uint8_t> bytes, std::span<const uint8_t> seal);

}  // namespace ruedo
