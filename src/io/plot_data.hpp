#pragma once

#include <cstddef>
#include <vector>

#include <flyball/io/plot.hpp>

/// What is drawn of long series, and the ranges of axes; private to io.
namespace flyball::io {

struct Points {
  std::vector<double> x;
  std::vector<double> y;
};

/// Thins a curve whose x ascends so that it looks the same on `pixels` columns: of each column the
/// first, least, greatest and last value stay, in their order, and so do gaps. Other curves are
/// returned as they are.
[[nodiscard]] Points thin_curve(const std::vector<double>& x, const std::vector<double>& y,
                                std::size_t pixels);

/// Thins a scatter to one point in each cell of a `columns` by `rows` grid.
[[nodiscard]] Points thin_scatter(const std::vector<double>& x, const std::vector<double>& y,
                                  std::size_t columns, std::size_t rows);

/// The finite (and, for a logarithmic axis, positive) extent of data.
class Range {
 public:
  explicit Range(bool logarithmic = false) : logarithmic_(logarithmic) {}

  void include(double value);
  void include(const std::vector<double>& values);
  [[nodiscard]] bool empty() const { return low_ > high_; }
  /// Opens a degenerate range and adds `fraction` of the span at either end.
  void pad(double fraction);
  /// Widens the range about its centre to `span`.
  void widen_to(double span);
  [[nodiscard]] double low() const { return low_; }
  [[nodiscard]] double high() const { return high_; }
  [[nodiscard]] double span() const { return high_ - low_; }

 private:
  bool logarithmic_;
  double low_ = 1.0;
  double high_ = -1.0;
};

/// The least of 1, 2 and 5 times a power of ten that divides `span` into at most `at_most` (at
/// least one) steps; 0 where there is no such number.
[[nodiscard]] double tick_step(double span, int at_most);

/// Moves an end of the range out to the next multiple of `step`, if it is nearly there.
void round_out(Range& range, double step);

}  // namespace flyball::io
