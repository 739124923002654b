#include <algorithm>
#include <utility>

#include "classical/quotient.hpp"

namespace flyball::classical::detail {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

bool same(const Polynomial& a, const Polynomial& b) {
  return a.rows() == b.rows() && a.hi == b.hi && a.lo == b.lo;
}

/// s or z itself.
bool is_variable(const Polynomial& p) {
  return p.rows() == 2 && p.hi(0, 0) == 1.0 && p.lo(0, 0) == 0.0 && p.hi(1, 0) == 0.0 &&
         p.lo(1, 0) == 0.0;
}

Index count_of(const RatioFactors& factors, const Polynomial& p) {
  for (const RatioFactor& factor : factors) {
    if (same(factor.p, p)) {
      return factor.times;
    }
  }
  return 0;
}

void remove(RatioFactors& factors, const Polynomial& p, Index times) {
  for (RatioFactor& factor : factors) {
    if (same(factor.p, p)) {
      factor.times -= times;
    }
  }
  std::erase_if(factors, [](const RatioFactor& factor) { return factor.times == 0; });
}

}  // namespace

Polynomial constant(double value) {
  return polynomial(VectorXd::Constant(1, value));
}

bool is_zero(const Polynomial& p) {
  return p.hi.isZero(0.0) && p.lo.isZero(0.0);
}

Index degree(const RatioFactors& factors) {
  Index sum = 0;
  for (const RatioFactor& factor : factors) {
    sum += (factor.p.rows() - 1) * factor.times;
  }
  return sum;
}

void multiply(RatioFactors& factors, const Polynomial& p, Index times) {
  for (RatioFactor& factor : factors) {
    if (same(factor.p, p)) {
      factor.times += times;
      return;
    }
  }
  factors.push_back({p, times});
}

RatioFactors common(const RatioFactors& a, const RatioFactors& b) {
  RatioFactors both;
  for (const RatioFactor& factor : a) {
    if (const Index times = std::min(factor.times, count_of(b, factor.p)); times > 0) {
      both.push_back({factor.p, times});
    }
  }
  return both;
}

RatioFactors without(RatioFactors factors, const RatioFactors& less) {
  for (const RatioFactor& factor : less) {
    remove(factors, factor.p, factor.times);
  }
  return factors;
}

RatioFactors together(RatioFactors factors, const RatioFactors& more) {
  for (const RatioFactor& factor : more) {
    multiply(factors, factor.p, factor.times);
  }
  return factors;
}

Polynomial expanded(const RatioFactors& factors, Polynomial p) {
  for (const RatioFactor& factor : factors) {
    for (Index i = 0; i < factor.times; ++i) {
      p = times(p, factor.p);
    }
  }
  return p;
}

Quotient number(double value) {
  return {.gain = constant(value)};
}

Quotient of_polynomial(const Polynomial& p) {
  const Polynomial q = trimmed(p);
  if (q.rows() == 1) {
    return {.gain = q};
  }
  return {.num = {{q, 1}}};
}

void clear_shifts(Quotient& q, char variable) {
  if (variable != 'z') {
    return;
  }
  for (const RatioFactor& factor : common(q.num, q.den)) {
    if (is_variable(factor.p)) {
      remove(q.num, factor.p, factor.times);
      remove(q.den, factor.p, factor.times);
    }
  }
}

Quotient product(const Quotient& a, const Quotient& b) {
  if (a.is_zero() || b.is_zero()) {
    return number(0.0);
  }
  return {.gain = times(a.gain, b.gain),
          .num = together(a.num, b.num),
          .den = together(a.den, b.den),
          .delay = a.delay + b.delay};
}

Quotient sum(const Quotient& a, double sign, const Quotient& b) {
  // a/c + b/d = (a d' + b c')/lcm(c, d), factors that both have kept in front.
  Quotient whole{.delay = a.delay};
  const RatioFactors in_front = common(a.num, b.num);
  const RatioFactors below = common(a.den, b.den);
  const RatioFactors only_a = without(a.den, below);
  const RatioFactors only_b = without(b.den, below);
  const Polynomial left = expanded(together(without(a.num, in_front), only_b), a.gain);
  const Polynomial right = expanded(together(without(b.num, in_front), only_a), b.gain);
  const Polynomial above = trimmed(plus(left, sign, right));
  if (is_zero(above)) {
    return number(0.0);
  }
  whole.num = in_front;
  whole.den = together(together(below, only_a), only_b);
  if (above.rows() == 1) {
    whole.gain = above;
  } else {
    multiply(whole.num, above, 1);
  }
  return whole;
}

}  // namespace flyball::classical::detail
