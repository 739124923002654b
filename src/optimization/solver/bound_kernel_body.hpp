#pragma once

// Sweeps over the bounds, four variables at a time, in the namespace FLYBALL_VARIANT.

namespace flyball::optimization::detail::FLYBALL_VARIANT {

namespace {

template <int Lanes>
struct Number;
template <>
struct Number<1> {
  using Type = double;
};
template <>
struct Number<4> {
  using Type = double __attribute__((vector_size(32), aligned(8), may_alias));
};
using Pack = Number<4>::Type;

template <int Lanes>
const typename Number<Lanes>::Type& at(const double* x, std::size_t i) {
  return *reinterpret_cast<const typename Number<Lanes>::Type*>(x + i);
}
template <int Lanes>
typename Number<Lanes>::Type& at(double* x, std::size_t i) {
  return *reinterpret_cast<typename Number<Lanes>::Type*>(x + i);
}
void raise(double& most, double x) {
  most = most < x ? x : most;
}
void raise(Pack& most, const Pack& x) {
  most = most < x ? x : most;
}

double sum(const Pack& x) {
  return (x[0] + x[1]) + (x[2] + x[3]);
}
double largest(const Pack& x) {
  double most = x[0];
  for (int i = 1; i < 4; ++i) {
    raise(most, static_cast<double>(x[i]));
  }
  return most;
}

/// Of each pack, then of what is left.
template <template <int> class Sweep>
void sweep(std::size_t count, Sweep<4>& packs, Sweep<1>& rest) {
  std::size_t i = 0;
  for (; i + 4 <= count; i += 4) {
    packs.step(i);
  }
  for (; i < count; ++i) {
    rest.step(i);
  }
}

/// A sweep that finds nothing but what it writes.
template <template <int> class Sweep, class... Numbers>
void sweep_all(const BoundArrays& a, Numbers... numbers) {
  Sweep<4> packs{a, numbers...};
  Sweep<1> rest{a, numbers...};
  sweep<Sweep>(a.count, packs, rest);
}

template <int Lanes>
struct Measure {
  using T = typename Number<Lanes>::Type;
  const BoundArrays& a;
  void step(std::size_t i) {
    at<Lanes>(a.sl, i) = at<Lanes>(a.w, i) - at<Lanes>(a.low, i);
    at<Lanes>(a.su, i) = at<Lanes>(a.high, i) - at<Lanes>(a.w, i);
  }
};

template <int Lanes>
struct Judge {
  using T = typename Number<Lanes>::Type;
  const BoundArrays& a;
  T dual{}, dual_sum{}, gap{}, most{}, multipliers{}, slope{}, moment{};
  void step(std::size_t i) {
    const T& zl = at<Lanes>(a.zl, i);
    const T& zu = at<Lanes>(a.zu, i);
    const T& w = at<Lanes>(a.w, i);
    const T left = (at<Lanes>(a.hw, i) + at<Lanes>(a.g, i) - zl + zu) * at<Lanes>(a.free, i);
    at<Lanes>(a.rd, i) = left;
    raise(dual, left);
    raise(dual, T(-left));
    dual_sum += left;
    const T low = at<Lanes>(a.sl, i) * zl;
    const T high = at<Lanes>(a.su, i) * zu;
    raise(most, low);
    raise(most, high);
    gap += low + high;
    multipliers += zl + zu;
    slope += at<Lanes>(a.g, i) * w;
    moment += w * at<Lanes>(a.hw, i);
  }
};

template <int Lanes>
struct Weigh {
  using T = typename Number<Lanes>::Type;
  const BoundArrays& a;
  double least;
  void step(std::size_t i) {
    const T il = at<Lanes>(a.has_low, i) / at<Lanes>(a.sl, i);
    const T iu = at<Lanes>(a.has_high, i) / at<Lanes>(a.su, i);
    at<Lanes>(a.il, i) = il;
    at<Lanes>(a.iu, i) = iu;
    at<Lanes>(a.diagonal, i) = at<Lanes>(a.zl, i) * il + at<Lanes>(a.zu, i) * iu + least;
    at<Lanes>(a.rw, i) = (at<Lanes>(a.hw, i) + at<Lanes>(a.g, i)) * at<Lanes>(a.free, i);
  }
};

template <int Lanes>
struct Predict {
  using T = typename Number<Lanes>::Type;
  const BoundArrays& a;
  // Of Δs/s: the predictor's Δz/z is -1 - Δs/s.
  T falling{}, rising{}, along{}, across{};
  void step(std::size_t i) {
    const T& dw = at<Lanes>(a.affine, i);
    const T& zl = at<Lanes>(a.zl, i);
    const T& zu = at<Lanes>(a.zu, i);
    const T low = dw * at<Lanes>(a.il, i);
    const T high = dw * at<Lanes>(a.iu, i);
    raise(falling, T(-low));
    raise(falling, high);
    raise(rising, low);
    raise(rising, T(-high));
    const T dzl = -zl - zl * low;
    const T dzu = zu * high - zu;
    at<Lanes>(a.dzl, i) = dzl;
    at<Lanes>(a.dzu, i) = dzu;
    along += dw * (zl - zu);
    across += dw * (dzl - dzu);
  }
};

template <int Lanes>
struct Aim {
  using T = typename Number<Lanes>::Type;
  const BoundArrays& a;
  double target;
  void step(std::size_t i) {
    const T& dw = at<Lanes>(a.affine, i);
    const T low = (target - dw * at<Lanes>(a.dzl, i)) * at<Lanes>(a.il, i);
    const T high = (target + dw * at<Lanes>(a.dzu, i)) * at<Lanes>(a.iu, i);
    at<Lanes>(a.rw, i) =
        (at<Lanes>(a.hw, i) + at<Lanes>(a.g, i) - low + high) * at<Lanes>(a.free, i);
    at<Lanes>(a.low_target, i) = low;
    at<Lanes>(a.high_target, i) = high;
  }
};

template <int Lanes>
struct Correct {
  using T = typename Number<Lanes>::Type;
  const BoundArrays& a;
  T falling{}, sinking{};
  void step(std::size_t i) {
    const T& dw = at<Lanes>(a.dw, i);
    const T& zl = at<Lanes>(a.zl, i);
    const T& zu = at<Lanes>(a.zu, i);
    const T low = dw * at<Lanes>(a.il, i);
    const T high = dw * at<Lanes>(a.iu, i);
    raise(falling, T(-low));
    raise(falling, high);
    const T dzl = at<Lanes>(a.low_target, i) - zl - zl * low;
    const T dzu = at<Lanes>(a.high_target, i) - zu + zu * high;
    at<Lanes>(a.dzl, i) = dzl;
    at<Lanes>(a.dzu, i) = dzu;
    // Where there is no bound, z and Δz are 0.
    raise(sinking, T(-dzl / (zl + (1.0 - at<Lanes>(a.has_low, i)))));
    raise(sinking, T(-dzu / (zu + (1.0 - at<Lanes>(a.has_high, i)))));
  }
};

template <int Lanes>
struct Advance {
  using T = typename Number<Lanes>::Type;
  const BoundArrays& a;
  double primal;
  double dual;
  void step(std::size_t i) {
    const T w = at<Lanes>(a.w, i) + primal * at<Lanes>(a.dw, i);
    at<Lanes>(a.w, i) = w;
    at<Lanes>(a.sl, i) = w - at<Lanes>(a.low, i);
    at<Lanes>(a.su, i) = at<Lanes>(a.high, i) - w;
    at<Lanes>(a.zl, i) += dual * at<Lanes>(a.dzl, i);
    at<Lanes>(a.zu, i) += dual * at<Lanes>(a.dzu, i);
  }
};

}  // namespace

void measure_bounds(const BoundArrays& a) noexcept {
  sweep_all<Measure>(a);
}

BoundErrors judge_bounds(const BoundArrays& a) noexcept {
  Judge<4> packs{a};
  Judge<1> rest{a};
  sweep<Judge>(a.count, packs, rest);
  BoundErrors errors;
  errors.dual = largest(packs.dual);
  raise(errors.dual, rest.dual);
  errors.dual_sum = sum(packs.dual_sum) + rest.dual_sum;
  errors.gap = sum(packs.gap) + rest.gap;
  errors.most = largest(packs.most);
  raise(errors.most, rest.most);
  errors.multipliers = sum(packs.multipliers) + rest.multipliers;
  errors.slope = sum(packs.slope) + rest.slope;
  errors.moment = sum(packs.moment) + rest.moment;
  return errors;
}

void weigh_bounds(const BoundArrays& a, double least) noexcept {
  sweep_all<Weigh>(a, least);
}

BoundSteps predict_bounds(const BoundArrays& a) noexcept {
  Predict<4> packs{a};
  Predict<1> rest{a};
  sweep<Predict>(a.count, packs, rest);
  BoundSteps steps;
  raise(steps.primal, largest(packs.falling));
  raise(steps.primal, rest.falling);
  raise(steps.dual, 1.0 + largest(packs.rising));
  raise(steps.dual, 1.0 + rest.rising);
  steps.along = sum(packs.along) + rest.along;
  steps.across = sum(packs.across) + rest.across;
  return steps;
}

void aim_bounds(const BoundArrays& a, double target) noexcept {
  sweep_all<Aim>(a, target);
}

BoundSteps correct_bounds(const BoundArrays& a, double keep) noexcept {
  Correct<4> packs{a};
  Correct<1> rest{a};
  sweep<Correct>(a.count, packs, rest);
  BoundSteps steps{.primal = keep, .dual = keep};
  raise(steps.primal, largest(packs.falling));
  raise(steps.primal, rest.falling);
  raise(steps.dual, largest(packs.sinking));
  raise(steps.dual, rest.sinking);
  return steps;
}

void advance_bounds(const BoundArrays& a, double primal, double dual) noexcept {
  sweep_all<Advance>(a, primal, dual);
}

}  // namespace flyball::optimization::detail::FLYBALL_VARIANT
