#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace flyball::optimization::detail {

/// Pairs (constraint violation θ, barrier function φ) that no later point may be dominated by.
/// Source: Wächter, Biegler, "On the implementation of an interior-point filter line-search
/// algorithm for large-scale nonlinear programming" (2006), section 2.3.
class Filter {
 public:
  Filter() { entries_.reserve(capacity); }

  void clear() noexcept { entries_.clear(); }
  [[nodiscard]] bool accepts(double theta, double phi) const noexcept {
    return std::none_of(entries_.begin(), entries_.end(), [&](const Entry& entry) {
      return theta >= entry.theta && phi >= entry.phi;
    });
  }
  void add(double theta, double phi) noexcept {
    std::erase_if(entries_,
                  [&](const Entry& entry) { return entry.theta >= theta && entry.phi >= phi; });
    if (entries_.size() == capacity) {  // the oldest goes rather than that memory is asked for
      entries_.erase(entries_.begin());
    }
    entries_.push_back({theta, phi});
  }

 private:
  static constexpr std::size_t capacity = 512;
  struct Entry {
    double theta;
    double phi;
  };
  std::vector<Entry> entries_;
};

}  // namespace flyball::optimization::detail
