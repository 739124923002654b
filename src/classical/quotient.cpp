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

Index count_of(const Factors& factors, const Polynomial& p) {
  for (const Factor& factor : factors) {
    if (same(factor.p, p)) {
      return factor.times;
    }
  }
  return 0;
}

void remove(Factors& factors, const Polynomial& p, Index times) {
  for (Factor& factor : factors) {
    if (same(factor.p, p)) {
      factor.times -= times;
    }
  }
  std::erase_if(factors, [](const Factor& factor) { return factor.times == 0; });
}

}  // namespace

Polynomial constant(double value) {
  return polynomial(VectorXd::Constant(1, value));
}

bool is_zero(const Polynomial& p) {
  return p.hi.isZero(0.0) && p.lo.isZero(0.0);
}

Index degree(const Factors& factors) {
  Index sum = 0;
  for (const Factor& factor : factors) {
    sum += (factor.p.rows() - 1) * factor.times;
  }
  return sum;
}

void multiply(Factors& factors, const Polynomial& p, Index times) {
  for (Factor& factor : factors) {
    if (same(factor.p, p)) {
      factor.times += times;
      return;
    }
  }
  factors.push_back({p, times});
}

Factors common(const Factors& a, const Factors& b) {
  Factors both;
  for (const Factor& factor : a) {
    if (const Index times = std::min(factor.times, count_of(b, factor.p)); times > 0) {
      both.push_back({factor.p, times});
    }
  }
  return both;
}

Factors without(Factors factors, const Factors& less) {
  for (const Factor& factor : less) {
    remove(factors, factor.p, factor.times);
  }
  return factors;
}

Factors together(Factors factors, const Factors& more) {
  for (const Factor& factor : more) {
    multiply(factors, factor.p, factor.times);
  }
  return factors;
}

Polynomial expanded(const Factors& factors, Polynomial p) {
  for (const Factor& factor : factors) {
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
  for (const Factor& factor : common(q.num, q.den)) {
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
  const Factors in_front = common(a.num, b.num);
  const Factors below = common(a.den, b.den);
  const Factors only_a = without(a.den, below);
  const Factors only_b = without(b.den, below);
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
