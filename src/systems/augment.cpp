#include <flyball/systems/augment.hpp>

#include <utility>

#include "core/try.hpp"
#include "systems/timed.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// `keep` is what the constants' own block of A holds: 0, or I for a discrete system.
Expected<ContinuousSystem<>> biased(const ContinuousSystem<>& plant, const MatrixRef& B_bias,
                                    const MatrixRef& C_bias, double keep) {
  constexpr std::string_view where = "augment_bias";
  FLYBALL_CHECK(check_system(plant, where));
  const Index n = plant.A.rows();
  const Index m = plant.B.cols();
  const Index p = plant.C.rows();
  const Index k = B_bias.cols();
  FLYBALL_CHECK(Checks(where)
                    .shape(B_bias, n, k, "B_bias", "states x constants")
                    .shape(C_bias, p, k, "C_bias", "outputs x constants")
                    .finite(B_bias, "B_bias")
                    .finite(C_bias, "C_bias"));
  ContinuousSystem<> augmented;
  augmented.A.resize(n + k, n + k);
  augmented.A << plant.A, B_bias, MatrixXd::Zero(k, n), keep * MatrixXd::Identity(k, k);
  augmented.B.resize(n + k, m);
  augmented.B << plant.B, MatrixXd::Zero(k, m);
  augmented.C.resize(p, n + k);
  augmented.C << plant.C, C_bias;
  augmented.D = plant.D;
  return augmented;
}

Expected<ContinuousSystem<>> with_outputs(const ContinuousSystem<>& plant, const MatrixRef& C_more,
                                          const MatrixRef& D_more) {
  constexpr std::string_view where = "augment_output";
  FLYBALL_CHECK(check_system(plant, where));
  const Index k = C_more.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(C_more, k, plant.A.rows(), "C_more", "new outputs x states")
                    .shape(D_more, k, plant.B.cols(), "D_more", "new outputs x inputs")
                    .finite(C_more, "C_more")
                    .finite(D_more, "D_more"));
  ContinuousSystem<> augmented{plant.A, plant.B, {}, {}};
  augmented.C.resize(plant.C.rows() + k, plant.A.rows());
  augmented.C << plant.C, C_more;
  augmented.D.resize(plant.C.rows() + k, plant.B.cols());
  augmented.D << plant.D, D_more;
  return augmented;
}

/// The period is checked after the rest: both are needed.
Expected<DiscreteSystem<>> timed(Expected<ContinuousSystem<>> augmented, Time period,
                                 std::string_view where) {
  FLYBALL_TRY(auto system, std::move(augmented));
  FLYBALL_CHECK(check_positive(period.si(), where, "period", "s"));
  return detail::timed(system, period);
}

}  // namespace

Expected<ContinuousSystem<>> augment_integral(const ContinuousSystem<>& plant) {
  FLYBALL_CHECK(check_system(plant, "augment_integral"));
  const Index n = plant.A.rows();
  const Index m = plant.B.cols();
  const Index p = plant.C.rows();
  ContinuousSystem<> augmented;
  augmented.A = MatrixXd::Zero(n + p, n + p);
  augmented.A.topLeftCorner(n, n) = plant.A;
  augmented.A.bottomLeftCorner(p, n) = -plant.C;
  augmented.B.resize(n + p, m);
  augmented.B << plant.B, -plant.D;
  augmented.C = MatrixXd::Zero(p, n + p);
  augmented.C.leftCols(n) = plant.C;
  augmented.D = plant.D;
  return augmented;
}

Expected<ContinuousSystem<>> augment_integral_reference(const ContinuousSystem<>& plant) {
  return augment_integral(plant).map([&](ContinuousSystem<> augmented) {
    const Index n = plant.A.rows();
    const Index m = plant.B.cols();
    const Index p = plant.C.rows();
    MatrixXd B = MatrixXd::Zero(n + p, m + p);
    B.leftCols(m) = augmented.B;
    B.bottomRightCorner(p, p).setIdentity();
    augmented.B = std::move(B);
    MatrixXd D = MatrixXd::Zero(p, m + p);
    D.leftCols(m) = augmented.D;
    augmented.D = std::move(D);
    return augmented;
  });
}

Expected<MatrixXd> augment_gain(const MatrixRef& K, const MatrixRef& K_I) {
  constexpr std::string_view where = "augment_gain";
  FLYBALL_CHECK(Checks(where)
                    .shape(K_I, K.rows(), K_I.cols(), "K_I", "inputs x integrals")
                    .finite(K, "K")
                    .finite(K_I, "K_I"));
  MatrixXd gain(K.rows(), K.cols() + K_I.cols());
  gain << K, K_I;
  return gain;
}

Expected<ContinuousSystem<>> augment_bias(const ContinuousSystem<>& plant, const MatrixRef& B_bias,
                                          const MatrixRef& C_bias) {
  return biased(plant, B_bias, C_bias, 0.0);
}
Expected<DiscreteSystem<>> augment_bias(const DiscreteSystem<>& plant, const MatrixRef& B_bias,
                                        const MatrixRef& C_bias) {
  return timed(biased(detail::bare(plant), B_bias, C_bias, 1.0), plant.period, "augment_bias");
}

Expected<ContinuousSystem<>> augment_output(const ContinuousSystem<>& plant,
                                            const MatrixRef& C_more, const MatrixRef& D_more) {
  return with_outputs(plant, C_more, D_more);
}
Expected<DiscreteSystem<>> augment_output(const DiscreteSystem<>& plant, const MatrixRef& C_more,
                                          const MatrixRef& D_more) {
  return timed(with_outputs(detail::bare(plant), C_more, D_more), plant.period, "augment_output");
}

}  // namespace flyball
