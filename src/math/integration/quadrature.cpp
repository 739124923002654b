#include <flyball/math/integration/quadrature.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <flyball/core/argument.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

// Positive nodes of the Kronrod rule with its weights; every second one is a node of Gauss's rule.
constexpr double nodes[] = {
    0.991455371120812639206854697526329, 0.949107912342758524526189684047851,
    0.864864423359769072789712788640926, 0.741531185599394439863864773280788,
    0.586087235467691130294144691693013, 0.405845151377397166906606412076961,
    0.207784955007898467600689403773245, 0.0};
constexpr double kronrod[] = {
    0.022935322010529224963732008058970, 0.063092092629978553290700663189204,
    0.104790010322250183839876322541518, 0.140653259715525918745189590510238,
    0.169004726639267902826583426598550, 0.190350578064785409913256402421014,
    0.204432940075298892414161999234649, 0.209482141084727828012999174891714};
constexpr double gauss[] = {
    0.129484966168869693270611432679082, 0.279705391489276667901467771423780,
    0.381830050505118944950369775488975, 0.417959183673469387755102040816327};

struct Piece {
  double low = 0.0;
  double high = 0.0;
  double value = 0.0;
  double error = 0.0;
  double size = 0.0;  ///< ∫ |f|, which rounding is relative to.
};

/// The rules on one piece; nothing where f is not a number, whose place is then in `place`.
template <class F>
std::optional<Piece> apply(const F& f, double low, double high, double& place) {
  const double middle = 0.5 * (low + high);
  const double half = 0.5 * (high - low);
  Piece piece{low, high};
  double coarse = 0.0;
  for (int i = 0; i < 8; ++i) {
    for (const double side : {-1.0, 1.0}) {
      if (i == 7 && side > 0.0) {
        break;
      }
      place = middle + side * half * nodes[i];
      const double y = f(place);
      if (!std::isfinite(y)) {
        return std::nullopt;
      }
      piece.value += half * kronrod[i] * y;
      piece.size += half * kronrod[i] * std::abs(y);
      coarse += i % 2 == 1 ? half * gauss[i / 2] * y : 0.0;
    }
  }
  piece.error = std::abs(piece.value - coarse);
  return piece;
}

template <class F>
Expected<Quadrature> integral(const F& f, double low, double high,
                              const QuadratureOptions& options) {
  constexpr std::string_view where = "quadrature";
  const auto smaller = [](const Piece& a, const Piece& b) { return a.error < b.error; };
  std::vector<Piece> pieces;
  Quadrature result;
  double size = 0.0;
  double place = 0.0;
  const auto add = [&](double from, double to) {
    const auto piece = apply(f, from, to, place);
    result.evaluations += 15;
    if (piece) {
      pieces.push_back(*piece);
      std::ranges::push_heap(pieces, smaller);
    }
    return piece.has_value();
  };
  // Several pieces at first, so that a peak between the nodes of one is not missed.
  constexpr int first = 8;
  for (int i = 0; i < first; ++i) {
    if (!add(low + (high - low) * i / first, low + (high - low) * (i + 1) / first)) {
      return refusal(IntegrationError::not_finite, where, "f")
          .got("not a number")
          .with("at", place);
    }
  }
  while (true) {
    result.value = result.error = size = 0.0;
    for (const Piece& piece : pieces) {
      result.value += piece.value;
      result.error += piece.error;
      size += piece.size;
    }
    const double wanted =
        std::max({options.absolute_tolerance, options.relative_tolerance * std::abs(result.value),
                  50.0 * epsilon * size});
    const Piece worst = pieces.front();
    const double middle = 0.5 * (worst.low + worst.high);
    if (result.error <= wanted || !(worst.low < middle && middle < worst.high)) {
      return result;
    }
    if (result.evaluations + 30 > options.most_evaluations) {
      return refusal(IntegrationError::too_many_steps, where, "the integral")
          .got("not known to the tolerance")
          .hint("split the interval where f is not smooth, or ask for less")
          .with("value", result.value)
          .with("error", result.error);
    }
    std::ranges::pop_heap(pieces, smaller);
    pieces.pop_back();
    if (!add(worst.low, middle) || !add(middle, worst.high)) {
      return refusal(IntegrationError::not_finite, where, "f")
          .got("not a number")
          .with("at", place);
    }
  }
}

}  // namespace

Expected<Quadrature> quadrature(FunctionRef<double(double)> f, double low, double high,
                                const QuadratureOptions& options) {
  if (std::isnan(low) || std::isnan(high)) {
    return refusal(ArgumentError::not_finite, "quadrature", "an end of the interval").got("NaN");
  }
  if (low > high) {
    return quadrature(f, high, low, options).map([](Quadrature result) {
      result.value = -result.value;
      return result;
    });
  }
  if (low == high) {
    return Quadrature{};
  }
  const bool open_low = std::isinf(low);
  const bool open_high = std::isinf(high);
  if (!open_low && !open_high) {
    return integral(f, low, high, options);
  }
  if (open_low && open_high) {  // x = t/(1 - t²)
    return integral(
        [&](double t) {
          const double rest = 1.0 - t * t;
          const double y = f(t / rest);
          return y == 0.0 ? 0.0 : y * (1.0 + t * t) / (rest * rest);
        },
        -1.0, 1.0, options);
  }
  // x = end ± t/(1 - t)
  const double end = open_low ? high : low;
  const double side = open_low ? -1.0 : 1.0;
  return integral(
      [&](double t) {
        const double rest = 1.0 - t;
        const double y = f(end + side * t / rest);
        return y == 0.0 ? 0.0 : y / (rest * rest);
      },
      0.0, 1.0, options);
}

}  // namespace flyball
