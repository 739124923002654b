#include <flyball/classical/filters/debouncer.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"

namespace flyball::classical {

Expected<Debouncer> Debouncer::create(double time, double period, DebounceEdge edge) {
  constexpr std::string_view where = "Debouncer";
  FLYBALL_CHECK(Checks(where).positive(period, "period", "s").not_negative(time, "time", "s"));
  // Whole periods stay whole: 0.06 s are three of 0.02 s.
  const double samples = std::ceil(time / period * (1.0 - 1e-12));
  constexpr double most = 1e15;
  if (!(samples <= most)) {
    return refusal(ArgumentError::out_of_range, where, "time")
        .got(format_number(time) + " s")
        .expected("at most 10¹⁵ periods");
  }
  Debouncer debouncer;
  debouncer.needed_ = std::max<std::int64_t>(1, static_cast<std::int64_t>(samples));
  debouncer.edge_ = edge;
  debouncer.reset(edge == DebounceEdge::falling);
  return debouncer;
}

bool Debouncer::calculate(bool x) noexcept {
  if (x == output_) {
    lasted_ = 0;
    return output_;
  }
  const bool waits = edge_ == DebounceEdge::both || (edge_ == DebounceEdge::rising) == x;
  if (!waits || ++lasted_ >= needed_) {
    output_ = x;
    lasted_ = 0;
  }
  return output_;
}

void Debouncer::reset(bool x) noexcept {
  output_ = x;
  lasted_ = 0;
}

}  // namespace flyball::classical
