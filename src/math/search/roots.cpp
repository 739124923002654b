#include <flyball/math/search/roots.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/constants.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "math/search/search.hpp"

namespace flyball {

ErrorInfo error_info(SearchError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"no_sign_change", "the function has one sign at both ends", ErrorKind::no_answer},
      {"not_finite", "the function is not a number", ErrorKind::no_answer},
      {"no_convergence", "the search did not end in the evaluations allowed", ErrorKind::no_answer},
  };
  return detail::info_of(code, "search", rows);
}

namespace detail {

Expected<void> check_search(double a, double b, const SearchOptions& options,
                            std::string_view where) {
  return Checks(where)
      .finite(a, "the bracket")
      .finite(b, "the bracket")
      .not_negative(options.absolute_tolerance, "absolute_tolerance")
      .within(options.relative_tolerance, 0.0, 1.0, "relative_tolerance")
      .within(options.most_evaluations, 1.0, 1e9, "most_evaluations");
}

Error not_a_number(double x, std::string_view where) {
  return refusal(SearchError::not_finite, where, "the function").got("not a number").with("x", x);
}

Error not_converged(double x, double value, double low, double high, std::string_view where) {
  return refusal(SearchError::no_convergence, where, "the search")
      .hint("give a larger tolerance")
      .with("x", x)
      .with("value", value)
      .with("bracket", {low, high});
}

}  // namespace detail

Expected<Root> find_root(FunctionRef<double(double)> f, double a, double b,
                         const SearchOptions& options) {
  FLYBALL_CHECK(detail::check_search(a, b, options, "find_root"));
  const double f_a = f(a);
  const double f_b = f(b);
  return find_root(f, a, b, f_a, f_b, options).map([](Root root) {
    root.evaluations += 2;
    return root;
  });
}

Expected<Root> find_root(FunctionRef<double(double)> f, double a, double b, double f_a, double f_b,
                         const SearchOptions& options) {
  constexpr std::string_view where = "find_root";
  FLYBALL_CHECK(detail::check_search(a, b, options, where));
  if (std::isnan(f_a) || std::isnan(f_b)) {
    return tl::unexpected(detail::not_a_number(std::isnan(f_a) ? a : b, where));
  }
  if (f_a == 0.0 || f_b == 0.0) {
    const double x = f_a == 0.0 ? a : b;
    return Root{x, 0.0, x, x, 0};
  }
  if ((f_a > 0.0) == (f_b > 0.0)) {
    return refusal(SearchError::no_sign_change, where, "the bracket")
        .hint("give two places where the function has different signs")
        .with("bracket", {a, b})
        .with("values", {f_a, f_b});
  }
  const double relative = std::max(options.relative_tolerance, 2.0 * epsilon);
  // a is the newest place, b the other end, c what a or b was before.
  double c = b;
  double f_c = f_b;
  double halving = 0.5 * std::abs(b - a);  // The length that three evaluations have to reach.
  int slow = 0;
  for (int evaluations = 0;; ++evaluations) {
    const bool a_is_better = std::abs(f_a) <= std::abs(f_b);
    const double best = a_is_better ? a : b;
    const double length = std::abs(b - a);
    const double target = std::max(options.absolute_tolerance + relative * std::abs(best),
                                   std::numeric_limits<double>::denorm_min());
    if (length <= target || f_a == 0.0) {
      const double residual = a_is_better ? f_a : f_b;
      return Root{best, residual, std::min(a, b), std::max(a, b), evaluations};
    }
    if (evaluations == options.most_evaluations) {
      return tl::unexpected(detail::not_converged(best, a_is_better ? f_a : f_b, std::min(a, b),
                                                  std::max(a, b), where));
    }
    // Where the three values lie on a curve that a sideways parabola follows monotonically, its
    // root; kept away from the ends, so that the bracket shrinks at both.
    double part = 0.5;
    if (length <= halving) {
      halving = 0.5 * length;
      slow = 0;
    }
    const double xi = (a - b) / (c - b);
    const double phi = (f_a - f_b) / (f_c - f_b);
    if (slow < 2 && phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi) {
      part = f_a / (f_b - f_a) * (f_c / (f_b - f_c)) +
             (c - a) / (b - a) * (f_a / (f_c - f_a)) * (f_b / (f_c - f_b));
    }
    slow = slow == 2 ? 0 : slow + 1;
    const double margin = std::min(0.5, 0.5 * target / length);
    part = part > margin ? std::min(part, 1.0 - margin) : margin;
    const double x = a + part * (b - a);
    const double value = f(x);
    if (std::isnan(value)) {
      return tl::unexpected(detail::not_a_number(x, where));
    }
    if ((value > 0.0) == (f_a > 0.0)) {
      c = a;
      f_c = f_a;
    } else {
      c = std::exchange(b, a);
      f_c = std::exchange(f_b, f_a);
    }
    a = x;
    f_a = value;
  }
}

}  // namespace flyball
