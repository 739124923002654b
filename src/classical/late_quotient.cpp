#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <utility>

#include <flyball/systems/system_error.hpp>

#include "classical/late_quotient.hpp"
#include "classical/locus_loop.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "systems/balance.hpp"

namespace flyball::classical::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

namespace {

constexpr std::string_view in_late_quotient = "transfer function";

bool identical(const Polynomial& a, const Polynomial& b) {
  return a.rows() == b.rows() && a.hi == b.hi && a.lo == b.lo;
}

bool identical(const LateSum& a, const LateSum& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const LateTerm& x, const LateTerm& y) {
                      return x.delay == y.delay && identical(x.p, y.p);
                    });
}

/// What two lists have in common, each as often as in both.
std::vector<LateSum> common(const std::vector<LateSum>& a, std::vector<LateSum> b) {
  std::vector<LateSum> both;
  for (const LateSum& sum : a) {
    const auto found = std::find_if(b.begin(), b.end(),
                                    [&](const LateSum& other) { return identical(sum, other); });
    if (found != b.end()) {
      both.push_back(sum);
      b.erase(found);
    }
  }
  return both;
}

std::vector<LateSum> without(std::vector<LateSum> sums, const std::vector<LateSum>& less) {
  for (const LateSum& sum : less) {
    const auto found = std::find_if(sums.begin(), sums.end(),
                                    [&](const LateSum& other) { return identical(sum, other); });
    if (found != sums.end()) {
      sums.erase(found);
    }
  }
  return sums;
}

std::vector<LateSum> together(std::vector<LateSum> sums, const std::vector<LateSum>& more) {
  sums.insert(sums.end(), more.begin(), more.end());
  return sums;
}

/// 0.1 + 0.2 and 0.3 are one delay.
bool same_delay(double a, double b) {
  return std::abs(a - b) <= 1e-12 * std::max(a, b);
}

void add(LateSum& sum, double delay, double sign, const Polynomial& p) {
  auto at = std::find_if(sum.begin(), sum.end(),
                         [&](const LateTerm& term) { return same_delay(term.delay, delay); });
  if (at == sum.end()) {
    at = std::find_if(sum.begin(), sum.end(),
                      [&](const LateTerm& term) { return term.delay > delay; });
    at = sum.insert(at, LateTerm{delay, constant(0.0)});
  }
  at->p = trimmed(plus(at->p, sign, p));
  if (is_zero(at->p)) {
    sum.erase(at);
  }
}

LateSum multiplied(const LateSum& a, const LateSum& b) {
  LateSum product;
  for (const LateTerm& x : a) {
    for (const LateTerm& y : b) {
      add(product, x.delay + y.delay, 1.0, times(x.p, y.p));
    }
  }
  return product;
}

LateSum multiplied(LateSum a, const std::vector<LateSum>& factors) {
  for (const LateSum& factor : factors) {
    a = multiplied(a, factor);
  }
  return a;
}

}  // namespace

Index degree(const LateQuotient& value) {
  const auto of = [](const RatioFactors& factors, const std::vector<LateSum>& sums) {
    Index total = degree(factors);
    for (const LateSum& sum : sums) {
      Index most = 0;
      for (const LateTerm& term : sum) {
        most = std::max(most, term.p.rows() - 1);
      }
      total += most;
    }
    return total;
  };
  return std::max(of(value.q.num, value.above), of(value.q.den, value.below));
}

std::size_t terms(const LateQuotient& value) {
  std::size_t most = 1;
  for (const auto* sums : {&value.above, &value.below}) {
    std::size_t all = 1;
    for (const LateSum& sum : *sums) {
      all *= sum.size();
    }
    most = std::max(most, all);
  }
  return most;
}

LateQuotient product(const LateQuotient& a, const LateQuotient& b) {
  if (a.is_zero() || b.is_zero()) {
    return {number(0.0)};
  }
  const std::vector<LateSum> left = common(a.above, b.below);
  const std::vector<LateSum> right = common(b.above, a.below);
  return {product(a.q, b.q), together(without(a.above, left), without(b.above, right)),
          together(without(a.below, right), without(b.below, left))};
}

LateQuotient sum(const LateQuotient& a, double sign, const LateQuotient& b) {
  if (a.is_rational() && b.is_rational() && a.q.delay == b.q.delay) {
    return {sum(a.q, sign, b.q)};
  }
  const RatioFactors in_front = common(a.q.num, b.q.num);
  const RatioFactors below = common(a.q.den, b.q.den);
  const RatioFactors only_a = without(a.q.den, below);
  const RatioFactors only_b = without(b.q.den, below);
  const std::vector<LateSum> front = common(a.above, b.above);
  const std::vector<LateSum> under = common(a.below, b.below);
  const std::vector<LateSum> under_a = without(a.below, under);
  const std::vector<LateSum> under_b = without(b.below, under);
  const auto side = [&](const LateQuotient& x, const RatioFactors& other,
                        const std::vector<LateSum>& under_other) {
    const Polynomial p = trimmed(expanded(together(without(x.q.num, in_front), other), x.q.gain));
    return multiplied(multiplied(LateSum{{x.q.delay, p}}, without(x.above, front)), under_other);
  };
  LateSum total = side(a, only_b, under_b);
  for (const LateTerm& term : side(b, only_a, under_a)) {
    add(total, term.delay, sign, term.p);
  }
  if (total.empty()) {
    return {number(0.0)};
  }
  LateQuotient whole;
  whole.q.num = in_front;
  whole.q.den = together(together(below, only_a), only_b);
  whole.above = front;
  whole.below = together(together(under, under_a), under_b);
  const double first = total.front().delay;
  whole.q.delay = first;
  if (total.size() > 1) {
    for (LateTerm& term : total) {
      term.delay -= first;
    }
    whole.above.push_back(std::move(total));
  } else if (total.front().p.rows() == 1) {
    whole.q.gain = total.front().p;
  } else {
    multiply(whole.q.num, total.front().p, 1);
  }
  return whole;
}

LateQuotient turned_over(const LateQuotient& b) {
  return {{.num = b.q.den, .den = b.q.num, .delay = -b.q.delay}, b.below, b.above};
}

namespace {

/// Sections in series, of one pole or of a pair: v = Π (its polynomial) ξ, the states of the k-th
/// are Π (those behind it) ξ and, of a pair, s times that.
class Chain {
 public:
  explicit Chain(std::vector<std::complex<double>> roots) {
    std::sort(roots.begin(), roots.end(), [](std::complex<double> a, std::complex<double> b) {
      return std::abs(a) > std::abs(b);
    });
    for (const std::complex<double> root : roots) {
      if (root.imag() == 0.0) {
        sections_.push_back({1, {-root.real(), 0.0}});
      } else if (root.imag() > 0.0) {
        sections_.push_back({2, {-2.0 * root.real(), std::norm(root)}});
      }
    }
    for (const Section& section : sections_) {
      states_ += section.order;
    }
  }

  [[nodiscard]] Index states() const { return states_; }

  /// x' = A x + b v
  [[nodiscard]] MatrixXd A() const {
    MatrixXd A = MatrixXd::Zero(states_, states_);
    Index at = 0;
    for (const Section& section : sections_) {
      const Index last = at + section.order - 1;
      if (at > 0) {
        A(last, first_of_before(at)) = 1.0;
      }
      if (section.order == 1) {
        A(at, at) = -section.p[0];
      } else {
        A(at, at + 1) = 1.0;
        A(last, at) = -section.p[1];
        A(last, last) = -section.p[0];
      }
      at += section.order;
    }
    return A;
  }
  [[nodiscard]] VectorXd b() const {
    VectorXd b = VectorXd::Zero(states_);
    if (states_ > 0) {
      b(sections_.front().order - 1) = 1.0;
    }
    return b;
  }

  /// p(s) ξ = c x + d v, of a polynomial of their degree at most: divided by the sections from the
  /// last on.
  struct Functional {
    RowVectorXd c;
    double d = 0.0;
  };
  [[nodiscard]] Functional of(const Polynomial& p) const {
    std::vector<long double> rest(static_cast<std::size_t>(p.rows()));
    for (std::size_t i = 0; i < rest.size(); ++i) {
      const auto row = static_cast<Index>(i);
      rest[i] = static_cast<long double>(p.hi(row, 0)) + static_cast<long double>(p.lo(row, 0));
    }
    Functional found{RowVectorXd::Zero(states_)};
    Index end = states_;
    for (auto section = sections_.rbegin(); section != sections_.rend(); ++section) {
      const auto order = static_cast<std::size_t>(section->order);
      end -= section->order;
      for (std::size_t i = 0; i + order < rest.size(); ++i) {
        for (std::size_t k = 0; k < order; ++k) {
          rest[i + k + 1] -= rest[i] * static_cast<long double>(section->p[k]);
        }
      }
      const std::size_t left = std::min(order, rest.size());
      for (std::size_t k = 0; k < left; ++k) {
        found.c(end + static_cast<Index>(k)) = static_cast<double>(rest[rest.size() - 1 - k]);
      }
      rest.resize(rest.size() - left);
    }
    found.d = rest.empty() ? 0.0 : static_cast<double>(rest.front());
    return found;
  }

 private:
  struct Section {
    Index order = 1;
    std::array<double, 2> p{};  ///< Its coefficients behind the leading one.
  };

  /// Where the output of the section before that of `at` stands.
  [[nodiscard]] Index first_of_before(Index at) const {
    Index first = 0;
    for (const Section& section : sections_) {
      if (first + section.order == at) {
        return first;
      }
      first += section.order;
    }
    return 0;
  }

  std::vector<Section> sections_;
  Index states_ = 0;
};

Expected<void> take_roots(const Polynomial& p, Index times,
                          std::vector<std::complex<double>>& all) {
  const auto found = roots(p);
  if (!found) {
    return refusal(SystemError::no_convergence, in_late_quotient, "a pole").got("not found");
  }
  for (const MultipleRoot& root : grouped(*found, p)) {
    all.insert(all.end(), static_cast<std::size_t>(root.times * times), root.at);
  }
  return {};
}

Expected<void> check_degrees(const LateSum& terms, Index most, std::string_view what) {
  for (const LateTerm& term : terms) {
    if (term.p.rows() - 1 > most) {
      return refusal(TransferError::improper, in_late_quotient, what)
          .got(flyball::detail::format("of degree {} at a dead time of {} s", term.p.rows() - 1,
                                       term.delay))
          .expected(flyball::detail::format("of degree {} at most, as the part below without dead "
                                            "time",
                                            most))
          .hint("add a fast pole, such as /(0.001*s + 1)");
    }
  }
  return {};
}

/// p/leading, in 31 digits.
Polynomial over(const Polynomial& p, const Polynomial& leading) {
  const auto divided = flyball::detail::solve(leading, p.transpose());
  return divided ? divided->transpose() : p;
}

}  // namespace

Expected<DelaySystem> realised(const LateQuotient& value, double gain, double delay) {
  LateSum above = multiplied(
      LateSum{{value.q.delay + delay, expanded(value.q.num, times(value.q.gain, constant(gain)))}},
      value.above);
  LateSum below = multiplied(LateSum{{0.0, expanded(value.q.den, constant(1.0))}}, value.below);
  const Index n = below.front().p.rows() - 1;
  FLYBALL_CHECK(check_degrees(below, n, "the denominator"));
  FLYBALL_CHECK(check_degrees(above, n, "the numerator"));
  const Polynomial leading = below.front().p.block(0, 0, 1, 1);
  for (LateSum* all : {&above, &below}) {
    for (LateTerm& term : *all) {
      term.p = over(term.p, leading);
    }
  }
  std::vector<std::complex<double>> poles;
  for (const RatioFactor& factor : value.q.den) {
    FLYBALL_CHECK(take_roots(factor.p, factor.times, poles));
  }
  for (const LateSum& sum : value.below) {
    if (sum.front().p.rows() > 1) {
      FLYBALL_CHECK(take_roots(sum.front().p, 1, poles));
    }
  }
  const Chain chain(std::move(poles));

  // v = u - r x - Σ w of the terms below, r what rounding the roots left of their polynomial;
  // z = c x + d v of each term with dead time; y = Σ c x + d v of those above without, and Σ w.
  const auto later = [](const LateTerm& term) { return term.delay > 0.0; };
  const Index k_below = static_cast<Index>(below.size()) - 1;
  const Index k = k_below + std::count_if(above.begin(), above.end(), later);
  const VectorXd b = chain.b();
  const RowVectorXd r = chain.of(below.front().p).c;
  RowVectorXd v_by_w = RowVectorXd::Zero(k);
  v_by_w.head(k_below).setConstant(-1.0);
  DelayForm f{chain.A() - b * r,    b,
              b * v_by_w,           MatrixXd::Zero(1, n),
              MatrixXd::Zero(k, n), MatrixXd::Zero(1, 1),
              MatrixXd::Zero(1, k), MatrixXd::Zero(k, 1),
              MatrixXd::Zero(k, k), VectorXd::Zero(k)};
  Index row = 0;
  const auto signal = [&](const LateTerm& term) {
    const Chain::Functional z = chain.of(term.p);
    f.C2.row(row) = z.c - z.d * r;
    f.D21(row, 0) = z.d;
    f.D22.row(row) = z.d * v_by_w;
    f.delays(row++) = term.delay;
  };
  std::for_each(below.begin() + 1, below.end(), signal);
  for (const LateTerm& term : above) {
    if (later(term)) {
      f.D12(0, row) = 1.0;
      signal(term);
    } else {
      const Chain::Functional y = chain.of(term.p);
      f.C1 += y.c - y.d * r;
      f.D11(0, 0) += y.d;
      f.D12 += y.d * v_by_w;
    }
  }
  // States of like size.
  MatrixXd in(n, k + 1);
  in << f.B1, f.B2;
  MatrixXd out(k + 1, n);
  out << f.C1, f.C2;
  const VectorXd d = flyball::detail::scaling_of(f.A, in, out).states;
  f.A = d.cwiseInverse().asDiagonal() * f.A * d.asDiagonal();
  f.B1 = d.cwiseInverse().asDiagonal() * f.B1;
  f.B2 = d.cwiseInverse().asDiagonal() * f.B2;
  f.C1 = f.C1 * d.asDiagonal();
  f.C2 = f.C2 * d.asDiagonal();
  return DelaySystem::create(f);
}

}  // namespace flyball::classical::detail
