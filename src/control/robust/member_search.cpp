#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "control/robust/member_search.hpp"
#include "core/constants.hpp"
#include "math/dense/dense.hpp"

namespace flyball::detail {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

constexpr Complex j(0.0, 1.0);

/// The power of two that makes a size one of 1 to 2, in which squares and quotients have all of
/// their digits; as two factors, of which each is a double.
struct OrdinaryUnit {
  explicit OrdinaryUnit(double size) {
    const int exponent = -std::ilogb(size);
    first = std::ldexp(1.0, exponent / 2);
    second = std::ldexp(1.0, exponent - exponent / 2);
  }
  double first, second;
};

Complex phase_of(const Complex& c) {
  const double largest = std::max(std::abs(c.real()), std::abs(c.imag()));
  if (!(largest > 0.0)) {
    return 1.0;
  }
  const OrdinaryUnit to(largest);
  const Complex ordinary = c * to.first * to.second;
  return ordinary / std::abs(ordinary);
}

VectorXcd unit(const VectorXcd& x) {
  const double largest = std::max(x.real().cwiseAbs().maxCoeff(), x.imag().cwiseAbs().maxCoeff());
  if (!(largest > 0.0)) {
    return VectorXcd::Unit(x.size(), 0);
  }
  const OrdinaryUnit to(largest);
  const VectorXcd ordinary = x * to.first * to.second;
  return ordinary / ordinary.norm();
}

}  // namespace

/// λ of Q M with yᴴx = 1.
struct MemberClimb::Eigenvalue {
  Complex value;
  VectorXcd x, y, z;  ///< z = M x
  double norm = 0.0;  ///< ‖Q M‖

  /// What λ's last digits are worth.
  [[nodiscard]] double rounding() const {
    return 4.0 * static_cast<double>(x.size()) * epsilon * norm * x.norm() * y.norm();
  }
};

MatrixXcd MemberClimb::matrix_of(const UnitMember& member) const {
  MatrixXcd Q = MatrixXcd::Zero(structure_.inputs, structure_.outputs);
  for (std::size_t b = 0; b < structure_.blocks.size(); ++b) {
    const BlockSpan& block = structure_.blocks[b];
    const UnitMember::Block& part = member.blocks[b];
    if (block.is_full()) {
      Q.block(block.in, block.out, block.rows, block.columns) =
          part.u.lazyProduct(part.v.adjoint());
    } else {
      Q.block(block.in, block.out, block.rows, block.rows).diagonal().setConstant(part.number);
    }
  }
  return Q;
}

std::optional<MemberClimb::Eigenvalue> MemberClimb::eigenvalue_of(const UnitMember& member,
                                                                  const Complex* near,
                                                                  bool real) const {
  const MatrixXcd M = M_.at(member.frequency);
  if (!M.allFinite()) {
    return std::nullopt;
  }
  const MatrixXcd Q = matrix_of(member);
  const MatrixXcd QM = Q.lazyProduct(M);
  const ComplexSchur schur = complex_schur_of_complex(QM);
  if (!schur.converged) {
    return std::nullopt;
  }
  const Index n = QM.rows();
  const auto merit = [&](const Complex& value) {
    return near != nullptr ? -std::abs(value - *near)
           : real          ? (std::abs(value.imag()) <= 1e-13 * std::abs(value.real())
                                  ? std::abs(value.real())
                                  : -std::abs(value.imag()))
           : complex_      ? std::abs(value)
                           : std::abs(value.real()) - 0.5 * std::abs(value.imag());
  };
  Index best = 0;
  for (Index k = 1; k < n; ++k) {
    best = merit(schur.T(k, k)) > merit(schur.T(best, best)) ? k : best;
  }
  const Complex value = schur.T(best, best);
  const double norm = QM.norm();
  const double least = std::max(epsilon * norm, std::numeric_limits<double>::min());
  const auto apart = [&](const Complex& d) { return std::abs(d) < least ? Complex(least) : d; };
  VectorXcd right = VectorXcd::Zero(n);
  right(best) = 1.0;
  for (Index i = best; i-- > 0;) {
    Complex sum = 0.0;
    for (Index k = i + 1; k <= best; ++k) {
      sum += schur.T(i, k) * right(k);
    }
    right(i) = -sum / apart(schur.T(i, i) - value);
  }
  VectorXcd left = VectorXcd::Zero(n);  // its conjugate
  left(best) = 1.0;
  for (Index i = best + 1; i < n; ++i) {
    Complex sum = 0.0;
    for (Index k = best; k < i; ++k) {
      sum += left(k) * schur.T(k, i);
    }
    left(i) = -sum / apart(schur.T(i, i) - value);
  }
  Eigenvalue pair{value,
                  unit(schur.U.lazyProduct(right)),
                  schur.U.lazyProduct(VectorXcd(left.conjugate())),
                  {},
                  norm};
  const Complex scale = pair.y.dot(pair.x);
  if (!(std::abs(scale) > 0.0) || !pair.x.allFinite() || !pair.y.allFinite()) {
    return std::nullopt;
  }
  pair.y /= std::conj(scale);
  pair.z = M.lazyProduct(pair.x);
  return pair;
}

/// dλ = yᴴ dQ z + yᴴ Q dM x, by each unknown: δ; an angle; the real and imaginary parts of u and v;
/// the frequency.
VectorXcd MemberClimb::slopes_of(const UnitMember& member, const Eigenvalue& pair) const {
  std::vector<Complex> slopes;
  for (std::size_t b = 0; b < structure_.blocks.size(); ++b) {
    const BlockSpan& block = structure_.blocks[b];
    const UnitMember::Block& part = member.blocks[b];
    const VectorXcd y = pair.y.segment(block.in, block.rows);
    const VectorXcd z = pair.z.segment(block.out, block.columns);
    if (!block.is_full()) {
      const Complex c = y.dot(z);
      slopes.push_back(block.is_real() ? c : j * part.number * c);
      continue;
    }
    const Complex seen = part.v.dot(z);
    const Complex driven = y.dot(part.u);
    for (const Complex& entry : y) {
      slopes.push_back(std::conj(entry) * seen);
      slopes.push_back(j * std::conj(entry) * seen);
    }
    for (const Complex& entry : z) {
      slopes.push_back(driven * entry);
      slopes.push_back(-j * driven * entry);
    }
  }
  if (M_.slope) {
    const MatrixXcd slope = M_.slope(member.frequency);
    const MatrixXcd Q = matrix_of(member);
    slopes.push_back(M_.step * pair.y.dot(Q.lazyProduct(slope.lazyProduct(pair.x))));
  }
  return Eigen::Map<const VectorXcd>(slopes.data(), static_cast<Index>(slopes.size()));
}

UnitMember MemberClimb::moved(const UnitMember& member, const VectorXd& step) const {
  UnitMember to = member;
  Index at = 0;
  for (std::size_t b = 0; b < structure_.blocks.size(); ++b) {
    const BlockSpan& block = structure_.blocks[b];
    UnitMember::Block& part = to.blocks[b];
    if (block.is_real()) {
      part.number = std::clamp(part.number.real() + step(at++), -1.0, 1.0);
    } else if (!block.is_full()) {
      part.number *= std::polar(1.0, step(at++));
    } else {
      for (VectorXcd* x : {&part.u, &part.v}) {
        for (Complex& entry : *x) {
          entry += Complex(step(at), step(at + 1));
          at += 2;
        }
        *x = unit(*x);
      }
    }
  }
  if (M_.slope) {
    to.frequency = std::max(0.0, to.frequency + M_.step * step(at));
  }
  return to;
}

/// The way that raises Re λ most, of a length, with what makes Im λ vanish; numbers that stand at
/// the ends of [-1, 1] do not move beyond.
VectorXd MemberClimb::step_from(const UnitMember& member, const Eigenvalue& pair,
                                double length) const {
  const VectorXcd slopes = slopes_of(member, pair);
  VectorXd up = slopes.real();
  VectorXd aside = slopes.imag();
  VectorXd step;
  for (std::size_t round = 0; round <= structure_.blocks.size(); ++round) {
    const double weight = aside.squaredNorm();
    const double noise = 1e-14 * slopes.norm();
    const bool turns = weight > noise * noise;
    VectorXd along = turns ? VectorXd(up - (up.dot(aside) / weight) * aside) : up;
    const double size = along.norm();
    along *= size > 0.0 ? length / size : 0.0;
    step = turns ? VectorXd(along - (pair.value.imag() / weight) * aside) : along;
    const double most = step.norm();
    if (most > 1.0) {
      step /= most;
    }
    bool blocked = false;
    Index at = 0;
    for (std::size_t b = 0; b < structure_.blocks.size(); ++b) {
      const BlockSpan& block = structure_.blocks[b];
      if (block.is_real()) {
        const double number = member.blocks[b].number.real();
        if (std::abs(number) >= 1.0 && number * step(at) > 0.0) {
          up(at) = 0.0;
          aside(at) = 0.0;
          blocked = true;
        }
      }
      at += block.is_full() ? 2 * (block.rows + block.columns) : 1;
    }
    if (!blocked) {
      return step;
    }
  }
  return step;
}

void MemberClimb::turn(UnitMember& member, const Complex& value) const {
  const Complex by = complex_             ? std::conj(phase_of(value))
                     : value.real() < 0.0 ? Complex(-1.0)
                                          : Complex(1.0);
  for (UnitMember::Block& part : member.blocks) {
    part.number *= by;
    part.u *= by;
  }
}

UnitMember MemberClimb::aligned(const VectorXcd& y, const VectorXcd& z, double frequency) const {
  UnitMember member{{}, frequency};
  for (const BlockSpan& block : structure_.blocks) {
    const VectorXcd left = y.segment(block.in, block.rows);
    const VectorXcd right = z.segment(block.out, block.columns);
    UnitMember::Block part;
    if (block.is_full()) {
      part.u = unit(left);
      part.v = unit(right);
    } else {
      const Complex c = left.dot(right);
      part.number = block.is_real() ? Complex(c.real() < 0.0 ? -1.0 : 1.0) : std::conj(phase_of(c));
    }
    member.blocks.push_back(std::move(part));
  }
  return member;
}

UnitMember MemberClimb::random(Random& random, double frequency) const {
  UnitMember member{{}, frequency};
  for (const BlockSpan& block : structure_.blocks) {
    UnitMember::Block part;
    part.number = block.is_real() ? Complex(random.uniform(-1.0, 1.0))
                                  : std::polar(1.0, random.uniform(0.0, 2.0 * std::numbers::pi));
    if (block.is_full()) {
      const auto draw = [&](Index size) {
        VectorXcd x(size);
        for (Complex& entry : x) {
          entry = {random.normal(), random.normal()};
        }
        return unit(x);
      };
      part.u = draw(block.rows);
      part.v = draw(block.columns);
    }
    member.blocks.push_back(std::move(part));
  }
  return member;
}

/// Power iteration: the member that is aligned with its own eigenvectors, as long as that raises
/// the eigenvalue.
std::optional<MemberClimb::Eigenvalue> MemberClimb::align(UnitMember& member) const {
  auto pair = eigenvalue_of(member, nullptr);
  if (!pair) {
    return pair;
  }
  const auto merit = [&](const Complex& value) {
    return complex_ ? std::abs(value) : std::abs(value.real()) - std::abs(value.imag());
  };
  constexpr int most_steps = 60;
  for (int k = 0; k < most_steps; ++k) {
    UnitMember next = aligned(pair->y, pair->z, member.frequency);
    auto found = eigenvalue_of(next, nullptr);
    const double before = merit(pair->value);
    if (!found || !(merit(found->value) > before)) {
      break;
    }
    member = std::move(next);
    pair = std::move(found);
    if (merit(pair->value) < before + 1e-13 * std::abs(before)) {
      break;
    }
  }
  return pair;
}

std::optional<SingularMember> MemberClimb::result(const UnitMember& member,
                                                  const Eigenvalue& pair) const {
  const double rounding = pair.rounding();
  // Below that neither λ nor what it is off by has digits.
  if (!(pair.norm >= std::numeric_limits<double>::min() / epsilon)) {
    return std::nullopt;
  }
  if (!(pair.value.real() > 0.0) || std::abs(pair.value.imag()) > 1e-12 * pair.value.real()) {
    return std::nullopt;
  }
  return SingularMember{member, pair.value.real(), rounding, pair.z};
}

std::optional<SingularMember> MemberClimb::look(const UnitMember& member) const {
  auto pair = eigenvalue_of(member, nullptr, !complex_);
  if (!pair) {
    return std::nullopt;
  }
  UnitMember positive = member;
  turn(positive, pair->value);
  pair->value = complex_ ? Complex(std::abs(pair->value))
                         : (pair->value.real() < 0.0 ? -pair->value : pair->value);
  return result(positive, *pair);
}

std::optional<SingularMember> MemberClimb::climb(UnitMember start) const {
  auto pair = align(start);
  if (!pair) {
    return std::nullopt;
  }
  turn(start, pair->value);
  pair = eigenvalue_of(start, nullptr);
  if (!pair) {
    return std::nullopt;
  }
  UnitMember member = std::move(start);
  std::optional<SingularMember> best;
  const auto keep = [&] {
    auto found = result(member, *pair);
    if (found && (!best || found->value > best->value)) {
      best = std::move(found);
    }
  };
  keep();
  const auto merit = [](const Complex& value) {
    return value.real() - 10.0 * std::abs(value.imag());
  };
  constexpr int most_steps = 120;
  double length = 0.3;
  for (int k = 0; k < most_steps && length > 1e-10; ++k) {
    const VectorXd step = step_from(member, *pair, length);
    const VectorXcd slopes = slopes_of(member, *pair);
    UnitMember next = moved(member, step);
    const Complex near = pair->value + Complex(slopes.real().dot(step), slopes.imag().dot(step));
    auto found = eigenvalue_of(next, &near);
    if (found && merit(found->value) > merit(pair->value)) {
      const double gained = merit(found->value) - merit(pair->value);
      member = std::move(next);
      pair = std::move(found);
      keep();
      if (gained < 1e-14 * std::abs(pair->value)) {
        break;
      }
      length = std::min(0.5, 1.6 * length);
    } else {
      length *= 0.3;
    }
  }
  // Newton's method on Im λ alone.
  for (int k = 0; k < 4; ++k) {
    const VectorXd step = step_from(member, *pair, 0.0);
    UnitMember next = moved(member, step);
    const Complex near = pair->value.real();
    auto found = eigenvalue_of(next, &near);
    if (!found || !(std::abs(found->value.imag()) < std::abs(pair->value.imag()))) {
      break;
    }
    member = std::move(next);
    pair = std::move(found);
    keep();
  }
  return best;
}

}  // namespace flyball::detail
