#include <flyball/control/robust/structured_singular_value.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "control/robust/scaled_point.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace detail {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;

namespace {

Eigen::VectorXd powers_of_two(const Eigen::VectorXi& exponents) {
  return exponents.unaryExpr([](int e) { return std::ldexp(1.0, e); });
}

}  // namespace

MatrixXcd ScaledPoint::coordinates_of(const MatrixXcd& M) const {
  MatrixXcd balanced(M.rows(), M.cols());
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      const int power = out(i) - in(j)-size;
      balanced(i, j) = {std::ldexp(M(i, j).real(), power), std::ldexp(M(i, j).imag(), power)};
    }
  }
  const MatrixXcd FM = F_out.lazyProduct(balanced);
  return FM.lazyProduct(F_in_inverse);
}

UnitMember ScaledPoint::first_member(const MatrixXcd& M, const MemberClimb& climb,
                                     double frequency) const {
  const Index m = M.cols();
  const MatrixXcd square = M.adjoint().lazyProduct(M);
  MatrixXd doubled(2 * m, 2 * m);
  doubled << square.real(), -square.imag(), square.imag(), square.real();
  const MatrixXd vectors = symmetric_eigensystem_of(symmetrized(doubled)).vectors;
  VectorXcd w(m);
  w.real() = vectors.col(2 * m - 1).head(m);
  w.imag() = vectors.col(2 * m - 1).tail(m);
  return climb.aligned(w, M.lazyProduct(w), frequency);
}

ScaledPoint scaled_point(const MatrixXcd& M, const UncertaintyStructure& structure, double enough,
                         double accuracy) {
  const BalancedMatrix balance = balanced(M, structure);
  const double inside = std::ldexp(enough, -balance.size);
  StructuredBound bound = least_structured_bound(balance.M, structure, inside * inside, accuracy);
  // Entries that powers of two bring below the normal numbers are known to within those.
  constexpr double lost = 0x1p-600;
  const double beta = proven_bound(balance.M, bound, lost);
  const Eigen::VectorXd out = powers_of_two(balance.out);
  const Eigen::VectorXd in = powers_of_two(balance.in);
  ScaledPoint point;
  point.scale = std::ldexp(1.0, balance.size);
  point.beta = std::ldexp(beta, balance.size);
  if (beta > 0.0 && point.beta < std::numeric_limits<double>::min()) {
    point.beta += std::numeric_limits<double>::denorm_min();  // It may have been rounded down.
  }
  const StructuredScaling& s = bound.scaling;
  MatrixXcd L_out = s.D_out;
  MatrixXcd L_in = s.D_in;
  if (!factor_hermitian(L_out) || !factor_hermitian(L_in)) {
    L_out.setIdentity();
    L_in.setIdentity();
  }
  point.F_out = L_out.adjoint();
  point.F_in_inverse = inverse_of_lower(L_in).adjoint();
  point.out = balance.out;
  point.in = balance.in;
  point.size = balance.size;
  point.work = bound.work;
  point.scaling.D_out = out.asDiagonal() * s.D_out * out.asDiagonal();
  point.scaling.D_in = in.asDiagonal() * s.D_in * in.asDiagonal();
  // D and G have one factor that is free: of a tiny M it keeps G among the normal numbers.
  double factor = 1.0;
  if (constexpr int tiny = -400; balance.size < tiny) {
    const double largest = std::max(point.scaling.D_out.cwiseAbs().maxCoeff(),
                                    point.scaling.D_in.cwiseAbs().maxCoeff());
    factor = std::ldexp(1.0, std::max(0, std::min(-balance.size, 500 - std::ilogb(largest))));
    point.scaling.D_out *= factor;
    point.scaling.D_in *= factor;
  }
  point.scaling.G = in.asDiagonal() * (factor * s.G) * out.asDiagonal();
  point.scaling.G *= point.scale;
  return point;
}

double residual_of(const MatrixXcd& M, const MatrixXcd& Q, const SingularMember& found) {
  const MatrixXcd delta = Q / found.value;
  const VectorXcd w = delta.lazyProduct(found.z);
  const VectorXcd rest = found.z - M.lazyProduct(w);
  return rest.norm() / ((1.0 + M.norm() * delta.norm()) * found.z.norm());
}

namespace {

/// Members at the corners of the real blocks' intervals.
class CornerSearch {
 public:
  explicit CornerSearch(const UncertaintyStructure& structure) : real_(0) {
    for (const BlockSpan& block : structure.blocks) {
      real_ += block.is_real() ? 1 : 0;
    }
    for (std::size_t b = 0; b < structure.blocks.size(); ++b) {
      if (structure.blocks[b].is_real()) {
        at_.push_back(b);
      }
    }
  }

  [[nodiscard]] unsigned corners() const noexcept { return 1u << std::min(real_, 12); }
  [[nodiscard]] UnitMember corner(UnitMember member, unsigned signs) const {
    for (std::size_t i = 0; i < at_.size(); ++i) {
      member.blocks[at_[i]].number = ((signs >> i) & 1u) != 0u ? -1.0 : 1.0;
    }
    return member;
  }

 private:
  int real_;
  std::vector<std::size_t> at_;
};

std::optional<SingularMember> worst_member(const MatrixXcd& M,
                                           const UncertaintyStructure& structure,
                                           const MemberClimb& climb, const UnitMember& first,
                                           double enough) {
  std::optional<SingularMember> best;
  const auto keep = [&](std::optional<SingularMember> found) {
    if (found && (!best || found->value - found->rounding > best->value - best->rounding)) {
      best = std::move(found);
    }
  };
  const auto done = [&] { return best && best->value >= enough; };
  keep(climb.climb(first));
  const bool all_real = std::all_of(structure.blocks.begin(), structure.blocks.end(),
                                    [](const BlockSpan& block) { return block.is_real(); });
  const bool has_real = structure.has_real();
  if (has_real && !done()) {
    const CornerSearch corners(structure);
    constexpr unsigned most_looks = 1024;
    constexpr unsigned most_climbs = 16;
    // Opposite corners have opposite eigenvalues.
    const unsigned half = std::max(1u, corners.corners() / 2);
    if (all_real && M.imag().isZero(0.0)) {
      for (unsigned k = 0; k < std::min(half, most_looks); ++k) {
        keep(climb.look(corners.corner(first, k)));
      }
      if (best && !done()) {
        keep(climb.climb(best->member));
      }
    }
    const unsigned climbs = std::min(all_real ? half : corners.corners(), most_climbs);
    for (unsigned k = 0; k < climbs && !done(); ++k) {
      keep(climb.climb(corners.corner(first, k)));
    }
  }
  Random random(1);
  const int draws = has_real ? 8 : 4;
  for (int k = 0; k < draws && !done(); ++k) {
    keep(climb.climb(climb.random(random, 0.0)));
  }
  return best;
}

}  // namespace

}  // namespace detail

Expected<StructuredSingularValue> structured_singular_value(
    const Eigen::MatrixXcd& M, const std::vector<UncertaintyBlock>& blocks) {
  constexpr std::string_view where = "structured_singular_value";
  if (M.size() == 0) {
    return refusal(ArgumentError::empty, where, "M").expected("of one entry at least");
  }
  FLYBALL_CHECK(Checks(where).finite(M.real(), "M").finite(M.imag(), "M's imaginary part"));
  FLYBALL_TRY(const auto structure, detail::structure_of(blocks, M.rows(), M.cols(), where));
  StructuredSingularValue mu;
  mu.delta = Eigen::MatrixXcd::Zero(M.cols(), M.rows());
  const detail::ScaledPoint point = detail::scaled_point(M, structure);
  mu.upper = point.beta;
  mu.scaling = point.scaling;
  if ((M.array() == 0.0).all()) {
    mu.upper = 0.0;
  }
  if (mu.upper == 0.0) {
    return mu;
  }
  const Eigen::MatrixXcd scaled = point.coordinates_of(M);
  const double upper = mu.upper / point.scale;
  const detail::MemberClimb climb(structure, {[&](double) { return scaled; }, {}, 1.0});
  const auto found = detail::worst_member(
      scaled, structure, climb, point.first_member(scaled, climb, 0.0), upper * (1.0 - 1e-6));
  // What is beyond a proof is rounding's.
  if (found && found->value > found->rounding &&
      found->value - found->rounding <= upper * (1.0 + 1e-9)) {
    const Eigen::MatrixXcd Q = climb.matrix_of(found->member);
    mu.lower = std::min(mu.upper, (found->value - found->rounding) * point.scale);
    mu.delta = Q / found->value / point.scale;
    mu.residual = detail::residual_of(scaled, Q, *found);
  }
  return mu;
}

}  // namespace flyball
