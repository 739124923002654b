#pragma once

#include <cstdint>
#include <string_view>

namespace flyball {

/// FNV-1a of 64 bits: tells that bytes were changed, not that they were forged.
/// Source: Fowler, Noll, Vo, Eastlake, Hansen, "The FNV Non-Cryptographic Hash Algorithm" (RFC
/// 9923).
/// @param sum  Of what stands before.
[[nodiscard]] constexpr std::uint64_t checksum(std::string_view bytes,
                                               std::uint64_t sum = 14695981039346656037U) noexcept {
  for (const char c : bytes) {
    sum = (sum ^ static_cast<unsigned char>(c)) * 1099511628211U;
  }
  return sum;
}

}  // namespace flyball
