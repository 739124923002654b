#include <flyball/core/quantity.hpp>

#include <flyball/core/unit_algebra.hpp>

#include "targets/require.hpp"

/// The first byte is the dimension that is expected.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flyball;
  if (size == 0) {
    return 0;
  }
  constexpr auto dimensions = static_cast<unsigned>(Dimension::frequency) + 1;
  const auto dimension = static_cast<Dimension>(data[0] % dimensions);
  const std::string_view text = fuzz::text_of(data + 1, size - 1);
  if (const auto si = parse_quantity(text, dimension, "fuzz")) {
    fuzz::require(std::isfinite(*si), "a quantity is finite");
    const auto again = parse_quantity(to_text(*si, dimension), dimension, "fuzz");
    fuzz::require(again && *again == *si, "a quantity reads back to the same number");
  }
  if (const auto parts = split_quantity(text, "fuzz")) {
    fuzz::require(std::isfinite(parts->number), "a quantity is finite");
    fuzz::require(parts->unit.size() <= text.size(), "a unit is part of the text");
  }
  (void)parse_unit(text);
  if (const auto unit = parse_si_unit(text)) {
    (void)to_text(unit->dimension);
  }
  return 0;
}
