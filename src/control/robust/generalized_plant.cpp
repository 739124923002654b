#include <flyball/control/robust/generalized_plant.hpp>

#include <cmath>
#include <limits>
#include <string>

#include "control/robust/partition.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "systems/algebraic_loop.hpp"

namespace flyball {

namespace {

using detail::bare;
using detail::product;
using detail::timed;
using Eigen::Index;
using Eigen::MatrixXd;
using Continuous = ContinuousSystem<>;
using Discrete = DiscreteSystem<>;

Expected<void> check_period(Time one, Time other, std::string_view where,
                            std::string_view subject) {
  if (std::abs(one.si() - other.si()) <= 1e-12 * one.si()) {
    return {};
  }
  return refusal(SystemError::period_mismatch, where, subject)
      .got(flyball::detail::format("of a period of {} s", other.si()))
      .expected(flyball::detail::format("of the plant's, {} s", one.si()));
}

/// The weight for `channels` signals; nothing where there is none.
Expected<std::optional<Continuous>> weight_for(const std::optional<Continuous>& weight,
                                               Index channels, std::string_view name) {
  constexpr std::string_view where = "mixed_sensitivity";
  if (!weight) {
    return std::optional<Continuous>();
  }
  FLYBALL_CHECK(check_system_or_gain(*weight, where));
  if (weight->B.cols() == channels) {
    return weight;
  }
  if (weight->B.cols() != 1 || weight->C.rows() != 1) {
    return refusal(ArgumentError::wrong_shape, where, name)
        .got(flyball::detail::format("of {} inputs", weight->B.cols()))
        .expected(flyball::detail::format("of {}, or of one input and output for every channel",
                                          channels));
  }
  const Index n = weight->A.rows();
  Continuous all{MatrixXd::Zero(n * channels, n * channels), MatrixXd::Zero(n * channels, channels),
                 MatrixXd::Zero(channels, n * channels), MatrixXd::Zero(channels, channels)};
  for (Index k = 0; k < channels; ++k) {
    all.A.block(k * n, k * n, n, n) = weight->A;
    all.B.block(k * n, k, n, 1) = weight->B;
    all.C.block(k, k * n, 1, n) = weight->C;
    all.D(k, k) = weight->D(0, 0);
  }
  return std::optional(all);
}

/// Rows and states of P that a weight adds: its input is E₀ x + E_w w + E_u u.
class Assembly {
 public:
  Assembly(const Continuous& plant, Index states, Index errors)
      : m_(plant.B.cols()),
        p_(plant.C.rows()),
        P_{MatrixXd::Zero(plant.A.rows() + states, plant.A.rows() + states),
           MatrixXd::Zero(plant.A.rows() + states, p_ + m_),
           MatrixXd::Zero(errors + p_, plant.A.rows() + states),
           MatrixXd::Zero(errors + p_, p_ + m_)},
        state_(plant.A.rows()) {
    const Index n = state_;
    P_.A.topLeftCorner(n, n) = plant.A;
    P_.B.topRightCorner(n, m_) = plant.B;
    // y = w - G u.
    P_.C.bottomLeftCorner(p_, n) = -plant.C;
    P_.D.bottomLeftCorner(p_, p_) = MatrixXd::Identity(p_, p_);
    P_.D.bottomRightCorner(p_, m_) = -plant.D;
  }

  void add(const std::optional<Continuous>& weight, const MatrixXd& E_x, const MatrixXd& E_w,
           const MatrixXd& E_u) {
    if (!weight) {
      return;
    }
    const auto& [A, B, C, D] = *weight;
    const Index n = A.rows();
    P_.A.block(state_, 0, n, E_x.cols()) = product(B, E_x);
    P_.A.block(state_, state_, n, n) = A;
    P_.B.block(state_, 0, n, p_) = product(B, E_w);
    P_.B.block(state_, p_, n, m_) = product(B, E_u);
    P_.C.block(row_, 0, C.rows(), E_x.cols()) = product(D, E_x);
    P_.C.block(row_, state_, C.rows(), n) = C;
    P_.D.block(row_, 0, C.rows(), p_) = product(D, E_w);
    P_.D.block(row_, p_, C.rows(), m_) = product(D, E_u);
    state_ += n;
    row_ += C.rows();
  }

  [[nodiscard]] GeneralizedPlant<Continuous> plant() && { return {std::move(P_), p_, m_}; }

 private:
  Index m_;
  Index p_;
  Continuous P_;
  Index state_;
  Index row_ = 0;
};

}  // namespace

namespace detail {

Expected<void> check_generalized(const Continuous& system, Index measurements, Index controls,
                                 std::string_view where) {
  FLYBALL_CHECK(check_system_or_gain(system, where));
  const auto count = [&](Index number, Index of, std::string_view subject,
                         std::string_view kind) -> Expected<void> {
    if (number >= 1 && number < of) {
      return {};
    }
    return refusal(ArgumentError::out_of_range, where, subject)
        .got(std::to_string(number))
        .expected(flyball::detail::format("from 1 to {}: of the {} {} some are not of them", of - 1,
                                          of, kind));
  };
  FLYBALL_CHECK(count(measurements, system.C.rows(), "the number of measurements", "outputs"));
  return count(controls, system.B.cols(), "the number of controls", "inputs");
}

Partition partition(const Continuous& s, Index measurements, Index controls) {
  const Index n = s.A.rows();
  const Index m1 = s.B.cols() - controls;
  const Index p1 = s.C.rows() - measurements;
  return {s.A,
          s.B.leftCols(m1),
          s.B.rightCols(controls),
          s.C.topRows(p1),
          s.C.bottomRows(measurements),
          s.D.topLeftCorner(p1, m1),
          s.D.topRightCorner(p1, controls),
          s.D.bottomLeftCorner(measurements, m1),
          s.D.bottomRightCorner(measurements, controls),
          n};
}

Expected<Continuous> closed(const Partition& P, const Continuous& K, std::string_view where) {
  const Index m2 = P.B2.cols();
  const Index q = K.A.rows();
  // u = (I - D_K D₂₂)⁻¹ (D_K C₂ x + C_K x_K + D_K D₂₁ w).
  MatrixXd right(m2, P.n + q + P.D21.cols());
  right << product(K.D, P.C2), K.C, product(K.D, P.D21);
  FLYBALL_TRY(const MatrixXd U,
              solve_algebraic_loop(
                  {K.D, P.D22, -1.0, "I - D22 D_K", "give the path from u to y a little dynamics"},
                  right, where));
  MatrixXd Y(P.C2.rows(), right.cols());
  Y << P.C2, MatrixXd::Zero(P.C2.rows(), q), P.D21;
  Y += product(P.D22, U);
  MatrixXd X = MatrixXd::Zero(P.n + q, right.cols());
  X.topRows(P.n) = product(P.B2, U);
  X.topLeftCorner(P.n, P.n) += P.A;
  X.topRightCorner(P.n, P.B1.cols()) += P.B1;
  X.bottomRows(q) = product(K.B, Y);
  X.block(P.n, P.n, q, q) += K.A;
  MatrixXd Z = product(P.D12, U);
  Z.leftCols(P.n) += P.C1;
  Z.rightCols(P.B1.cols()) += P.D11;
  const Index m1 = P.B1.cols();
  return Continuous{X.leftCols(P.n + q), X.rightCols(m1), Z.leftCols(P.n + q), Z.rightCols(m1)};
}

}  // namespace detail

Expected<Continuous> lower_fractional(const GeneralizedPlant<Continuous>& plant,
                                      const Continuous& controller) {
  constexpr std::string_view where = "lower_fractional";
  FLYBALL_CHECK(detail::check_generalized(plant.system, plant.measurements, plant.controls, where));
  FLYBALL_CHECK(check_system_or_gain(controller, where));
  FLYBALL_CHECK(Checks(where).shape(controller.D, plant.controls, plant.measurements,
                                    "the controller's D", "controls x measurements"));
  return detail::closed(detail::partition(plant.system, plant.measurements, plant.controls),
                        controller, where);
}

Expected<Discrete> lower_fractional(const GeneralizedPlant<Discrete>& plant,
                                    const Discrete& controller) {
  constexpr std::string_view where = "lower_fractional";
  FLYBALL_CHECK(check_system_or_gain(plant.system, where));
  FLYBALL_CHECK(check_system_or_gain(controller, where));
  FLYBALL_CHECK(
      check_period(plant.system.period, controller.period, where, "the controller's period"));
  return lower_fractional({bare(plant.system), plant.measurements, plant.controls},
                          bare(controller))
      .map([&](const Continuous& s) { return timed(s, plant.system.period); });
}

Expected<GeneralizedPlant<Continuous>> mixed_sensitivity_plant(
    const Continuous& plant, const SensitivityWeights<Continuous>& weights) {
  constexpr std::string_view where = "mixed_sensitivity";
  FLYBALL_CHECK(check_system_or_gain(plant, where));
  const Index n = plant.A.rows();
  const Index m = plant.B.cols();
  const Index p = plant.C.rows();
  FLYBALL_TRY(const auto W1, weight_for(weights.error, p, "W1"));
  FLYBALL_TRY(const auto W2, weight_for(weights.input, m, "W2"));
  FLYBALL_TRY(const auto W3, weight_for(weights.output, p, "W3"));
  Index states = 0;
  Index errors = 0;
  for (const auto* weight : {&W1, &W2, &W3}) {
    states += *weight ? (*weight)->A.rows() : 0;
    errors += *weight ? (*weight)->C.rows() : 0;
  }
  if (errors == 0) {
    return refusal(ArgumentError::empty, where, "the weights")
        .got("none")
        .expected("one at least: of the error, the input or the output");
  }
  Assembly assembly(plant, states, errors);
  assembly.add(W1, -plant.C, MatrixXd::Identity(p, p), -plant.D);
  assembly.add(W2, MatrixXd::Zero(m, n), MatrixXd::Zero(m, p), MatrixXd::Identity(m, m));
  assembly.add(W3, plant.C, MatrixXd::Zero(p, p), plant.D);
  return std::move(assembly).plant();
}

Expected<GeneralizedPlant<Discrete>> mixed_sensitivity_plant(
    const Discrete& plant, const SensitivityWeights<Discrete>& weights) {
  constexpr std::string_view where = "mixed_sensitivity";
  FLYBALL_CHECK(check_system_or_gain(plant, where));
  const auto untimed = [&](const std::optional<Discrete>& weight,
                           std::string_view name) -> Expected<std::optional<Continuous>> {
    if (!weight) {
      return std::optional<Continuous>();
    }
    return check_period(plant.period, weight->period, where, name).map([&] {
      return std::optional(bare(*weight));
    });
  };
  FLYBALL_TRY(auto W1, untimed(weights.error, "W1"));
  FLYBALL_TRY(auto W2, untimed(weights.input, "W2"));
  FLYBALL_TRY(auto W3, untimed(weights.output, "W3"));
  return mixed_sensitivity_plant(bare(plant), {std::move(W1), std::move(W2), std::move(W3)})
      .map([&](const GeneralizedPlant<Continuous>& P) {
        return GeneralizedPlant<Discrete>{timed(P.system, plant.period), P.measurements,
                                          P.controls};
      });
}

}  // namespace flyball
