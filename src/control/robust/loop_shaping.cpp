#include <flyball/control/robust/loop_shaping.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/systems/controllability.hpp>
#include <flyball/systems/conversion.hpp>
#include <flyball/systems/interconnection.hpp>
#include <flyball/systems/norms.hpp>

#include "control/robust/partition.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/riccati/riccati_work.hpp"

namespace flyball {

namespace {

using detail::bare;
using detail::product;
using detail::timed;
using Eigen::Index;
using Eigen::MatrixXd;
using Continuous = ContinuousSystem<>;
using Discrete = DiscreteSystem<>;

constexpr double bilinear_unit = 2.0;  ///< T of s = (z - 1)/(z + 1).

Continuous negative(Continuous s) {
  s.C = -s.C;
  s.D = -s.D;
  return s;
}

/// [I; K](I + GK)⁻¹[I, G]: z = [y; -u] with y = w₁ + G (w₂ + u).
Expected<Continuous> four_blocks(const Continuous& G, const Continuous& K, std::string_view where) {
  const Index n = G.A.rows();
  const Index m = G.B.cols();
  const Index p = G.C.rows();
  FLYBALL_CHECK(Checks(where).shape(K.D, m, p, "the controller's D", "inputs x outputs of G"));
  detail::Partition P;
  P.n = n;
  P.A = G.A;
  P.B1 = MatrixXd::Zero(n, p + m);
  P.B1.rightCols(m) = G.B;
  P.B2 = G.B;
  P.C1 = MatrixXd::Zero(p + m, n);
  P.C1.topRows(p) = G.C;
  P.C2 = G.C;
  P.D21 = MatrixXd::Zero(p, p + m);
  P.D21.leftCols(p).setIdentity();
  P.D21.rightCols(m) = G.D;
  P.D11 = MatrixXd::Zero(p + m, p + m);
  P.D11.topRows(p) = P.D21;
  P.D12 = MatrixXd::Zero(p + m, m);
  P.D12.topRows(p) = G.D;
  P.D12.bottomRows(m) = -MatrixXd::Identity(m, m);
  P.D22 = G.D;
  return detail::closed(P, negative(K), where);
}

/// The map between discrete and continuous systems that keeps gains.
Expected<Continuous> mapped(const Discrete& system, std::string_view where) {
  if (system.A.size() == 0) {
    return bare(system);
  }
  FLYBALL_TRY_IN(
      where, auto found,
      convert_to_continuous(timed(bare(system), Time(bilinear_unit)), ConversionMethod::tustin));
  return found;
}

Expected<Discrete> mapped_back(const Continuous& system, Time period, std::string_view where) {
  if (system.A.size() == 0) {
    return timed(system, period);
  }
  FLYBALL_TRY_IN(where, auto found,
                 convert_to_discrete(system, Time(bilinear_unit), ConversionMethod::tustin));
  return timed(bare(found), period);
}

template <class System>
Expected<System> shaped(const System& plant, const LoopShape<System>& shape) {
  System all = plant;
  if (shape.before) {
    FLYBALL_TRY_IN("loop_shaping", all, series(*shape.before, all));
  }
  if (shape.behind) {
    FLYBALL_TRY_IN("loop_shaping", all, series(all, *shape.behind));
  }
  return all;
}

template <class System>
Expected<System> unshaped(const System& controller, const LoopShape<System>& shape) {
  System all = controller;
  if (shape.behind) {
    FLYBALL_TRY_IN("loop_shaping", all, series(*shape.behind, all));
  }
  if (shape.before) {
    FLYBALL_TRY_IN("loop_shaping", all, series(all, *shape.before));
  }
  return all;
}

template <class Analysis>
Expected<void> check_modes(const Analysis& analysis, bool fine, SynthesisError code,
                           std::string_view subject) {
  if (fine) {
    return {};
  }
  for (const ModeReach& mode : analysis.modes) {
    if (!mode.reached && mode.stability != Stability::stable) {
      return refusal(code, "loop_shaping", subject)
          .hint("a weight's zero must not cancel a pole of the plant, or the reverse, there")
          .with("mode", {mode.eigenvalue.real(), mode.eigenvalue.imag()});
    }
  }
  return {};
}

/// Of the shaped plant, the controller of negative feedback. @return K_s and the largest ε.
Expected<LoopShapingDesign<Continuous>> stabilized(const Continuous& G, double factor) {
  constexpr std::string_view where = "loop_shaping";
  FLYBALL_CHECK(check_system(G, where));
  if (!(factor > 1.0) || !std::isfinite(factor)) {
    return refusal(ArgumentError::out_of_range, where, "factor")
        .got(format_number(factor))
        .expected("above 1, such as 1.1");
  }
  const auto& [A, B, C, D] = G;
  const Index n = A.rows();
  FLYBALL_TRY_IN(where, const auto reach, analyze_controllability(A, B, TimeDomain::continuous));
  FLYBALL_CHECK(
      check_modes(reach, reach.stabilizable, SynthesisError::not_stabilizable, "the shaped plant"));
  FLYBALL_TRY_IN(where, const auto sight, analyze_observability(A, C, TimeDomain::continuous));
  FLYBALL_CHECK(
      check_modes(sight, sight.detectable, SynthesisError::not_detectable, "the shaped plant"));
  const MatrixXd S = MatrixXd::Identity(D.cols(), D.cols()) + detail::transposed_product(D, D);
  const MatrixXd R = MatrixXd::Identity(D.rows(), D.rows()) + detail::product_transposed(D, D);
  auto work = detail::CarefulWork::of_a_second(n);
  FLYBALL_TRY_IN(where, const auto X,
                 detail::care_within(A, B, detail::transposed_product(C, C), detail::symmetrized(S),
                                     detail::transposed_product(C, D), work));
  FLYBALL_TRY_IN(
      where, const auto Z,
      detail::care_within(A.transpose(), C.transpose(), detail::product_transposed(B, B),
                          detail::symmetrized(R), detail::product_transposed(B, D), work));
  const MatrixXd XZ = product(X.X, Z.X);
  const double coupling = detail::eigenvalues_of(XZ).cwiseAbs().maxCoeff();
  const double least = std::sqrt(1.0 + coupling);
  const double square = factor * factor * least * least;
  LoopShapingDesign<Continuous> design;
  design.shaped_plant = G;
  design.largest_margin = 1.0 / least;
  // (9.70) with F = -K of X; L = (1 - γ²) I + XZ. Negative feedback: the signs of C and D turn.
  const MatrixXd L = (1.0 - square) * MatrixXd::Identity(n, n) + XZ;
  const MatrixXd H =
      square * detail::solve_linear(L.transpose(), detail::product_transposed(Z.X, C));
  Continuous& K = design.shaped_controller;
  K.A = A - product(B, X.K) + product(H, C - product(D, X.K));
  K.B = H;
  K.C = -detail::transposed_product(B, X.X);
  K.D = D.transpose();
  FLYBALL_TRY(const auto loop, four_blocks(G, K, where));
  design.poles = detail::eigenvalues_of(loop.A);
  const auto norm = h_infinity_norm(loop);
  // A hundredth for rounding, where the two Riccati solutions are far apart.
  if (!norm || !(norm->norm <= std::sqrt(square) * 1.01)) {
    return refusal(SynthesisError::not_verified, where, "the controller")
        .got("not what it should be: its loop is unstable or of a smaller margin, by rounding")
        .hint("measure time and signals in units in which the shaped plant's entries are near one")
        .with("largest margin", design.largest_margin);
  }
  design.margin = 1.0 / norm->norm;
  return design;
}

}  // namespace

Expected<double> coprime_margin(const Continuous& plant, const Continuous& controller) {
  constexpr std::string_view where = "coprime_margin";
  FLYBALL_CHECK(check_system_or_gain(plant, where));
  FLYBALL_CHECK(check_system_or_gain(controller, where));
  FLYBALL_TRY(const auto loop, four_blocks(plant, controller, where));
  const auto norm = h_infinity_norm(loop);
  if (!norm && norm.error().is(SystemError::not_stable)) {
    return 0.0;
  }
  return norm.map([](const HInfinityNorm& n) { return 1.0 / n.norm; });
}

Expected<double> coprime_margin(const Discrete& plant, const Discrete& controller) {
  constexpr std::string_view where = "coprime_margin";
  FLYBALL_CHECK(check_system_or_gain(plant, where));
  FLYBALL_CHECK(check_system_or_gain(controller, where));
  if (std::abs(plant.period.si() - controller.period.si()) > 1e-12 * plant.period.si()) {
    return refusal(SystemError::period_mismatch, where, "the controller's period")
        .got(format_number(controller.period.si()) + " s")
        .expected("the plant's, " + format_number(plant.period.si()) + " s");
  }
  FLYBALL_TRY(const auto loop, four_blocks(bare(plant), bare(controller), where));
  const auto norm = h_infinity_norm(timed(loop, plant.period));
  if (!norm && norm.error().is(SystemError::not_stable)) {
    return 0.0;
  }
  return norm.map([](const HInfinityNorm& n) { return 1.0 / n.norm; });
}

Expected<LoopShapingDesign<Continuous>> loop_shaping(const Continuous& plant,
                                                     const LoopShape<Continuous>& shape,
                                                     double factor) {
  FLYBALL_CHECK(check_system_or_gain(plant, "loop_shaping"));
  FLYBALL_TRY(const auto G, shaped(plant, shape));
  FLYBALL_TRY(auto design, stabilized(G, factor));
  FLYBALL_TRY(design.controller, unshaped(design.shaped_controller, shape));
  return design;
}

Expected<LoopShapingDesign<Discrete>> loop_shaping(const Discrete& plant,
                                                   const LoopShape<Discrete>& shape,
                                                   double factor) {
  constexpr std::string_view where = "loop_shaping";
  FLYBALL_CHECK(check_system_or_gain(plant, where));
  LoopShapingDesign<Discrete> found;
  FLYBALL_TRY(found.shaped_plant, shaped(plant, shape));
  FLYBALL_TRY(const auto G, mapped(found.shaped_plant, where));
  FLYBALL_TRY(const auto design, stabilized(G, factor));
  FLYBALL_TRY(found.shaped_controller, mapped_back(design.shaped_controller, plant.period, where));
  FLYBALL_TRY(found.controller, unshaped(found.shaped_controller, shape));
  FLYBALL_TRY(const auto loop,
              four_blocks(bare(found.shaped_plant), bare(found.shaped_controller), where));
  found.poles = detail::eigenvalues_of(loop.A);
  FLYBALL_TRY(found.margin, coprime_margin(found.shaped_plant, found.shaped_controller));
  found.largest_margin = design.largest_margin;
  if (!(found.margin >= design.margin * (1.0 - 1e-6))) {
    return refusal(SynthesisError::not_verified, where, "the controller")
        .got("not what it should be after the bilinear transform")
        .hint("a larger factor leaves it more distance from the least");
  }
  return found;
}

}  // namespace flyball
