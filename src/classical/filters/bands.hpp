#pragma once

#include <flyball/classical/filters/iir_design.hpp>

namespace flyball::classical {

/// A pass or stop band between two frequencies, not on one side of one.
[[nodiscard]] inline bool has_two_edges(FilterBand band) {
  return band == FilterBand::band_pass || band == FilterBand::band_stop;
}

}  // namespace flyball::classical
