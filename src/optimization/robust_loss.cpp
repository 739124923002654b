#include <flyball/optimization/robust_loss.hpp>

#include <cmath>

namespace flyball::optimization {

namespace {

/// ρ(s) of the kinds for the scale 1.
LossValue unit_loss(Loss kind, double s) {
  switch (kind) {
    case Loss::squared:
      break;
    case Loss::soft_l1: {
      const double root = std::sqrt(1.0 + s);
      return {2.0 * s / (root + 1.0), 1.0 / root, -0.5 / (root * root * root)};
    }
    case Loss::huber: {
      if (s <= 1.0) {
        break;
      }
      const double size = std::sqrt(s);
      return {2.0 * size - 1.0, 1.0 / size, -0.5 / (size * s)};
    }
    case Loss::cauchy: {
      const double whole = 1.0 + s;
      return {std::log1p(s), 1.0 / whole, -1.0 / (whole * whole)};
    }
    case Loss::tukey: {
      if (s > 1.0) {
        return {1.0 / 3.0, 0.0, 0.0};
      }
      const double rest = 1.0 - s;
      return {s * (1.0 - s * (1.0 - s / 3.0)), rest * rest, -2.0 * rest};
    }
  }
  return {s, 1.0, 0.0};
}

}  // namespace

std::string_view to_string(Loss loss) {
  switch (loss) {
    case Loss::squared:
      return "squared";
    case Loss::soft_l1:
      return "soft_l1";
    case Loss::huber:
      return "huber";
    case Loss::cauchy:
      return "cauchy";
    case Loss::tukey:
      return "tukey";
  }
  return "unknown";
}

LossValue RobustLoss::operator()(double square) const noexcept {
  if (kind == Loss::squared) {
    return {square, 1.0, 0.0};
  }
  const double k2 = scale * scale;
  const LossValue unit = unit_loss(kind, square / k2);
  return {k2 * unit.value, unit.slope, unit.bend / k2};
}

}  // namespace flyball::optimization
