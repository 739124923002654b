#include <flyball/control/pole_placement.hpp>

#include <cmath>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/core/random.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::pole_placement_test {
namespace {

using namespace flyball::literals;
using Complex = std::complex<double>;

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

Eigen::MatrixXd matrix_from(const nlohmann::json& rows) {
  Eigen::MatrixXd M(static_cast<Eigen::Index>(rows.size()),
                    static_cast<Eigen::Index>(rows.at(0).size()));
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    for (Eigen::Index j = 0; j < M.cols(); ++j) {
      M(i, j) = rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j)).get<double>();
    }
  }
  return M;
}

Eigen::VectorXcd poles_from(const nlohmann::json& rows) {
  Eigen::VectorXcd poles(static_cast<Eigen::Index>(rows.size()));
  for (Eigen::Index i = 0; i < poles.size(); ++i) {
    const auto& pole = rows.at(static_cast<std::size_t>(i));
    poles(i) = Complex(pole.at(0).get<double>(), pole.at(1).get<double>());
  }
  return poles;
}

/// The largest of |reached - wanted| / (max(1, |wanted|) condition of that eigenvalue), by Eigen.
double worst(const Eigen::MatrixXd& closed, const Eigen::VectorXcd& wanted) {
  const auto [values, vectors] = test::modes_of(closed);
  Eigen::MatrixXcd V = vectors;
  V.colwise().normalize();
  const Eigen::MatrixXcd left = test::inverse(V);
  std::vector<bool> taken(static_cast<std::size_t>(wanted.size()), false);
  double largest = 0.0;
  for (const Complex& pole : wanted) {
    Eigen::Index nearest = -1;
    for (Eigen::Index i = 0; i < wanted.size(); ++i) {
      if (!taken[static_cast<std::size_t>(i)] &&
          (nearest < 0 || std::abs(values(i) - pole) < std::abs(values(nearest) - pole))) {
        nearest = i;
      }
    }
    taken[static_cast<std::size_t>(nearest)] = true;
    const double sensitivity = std::max(1.0, left.row(nearest).norm());
    largest = std::max(
        largest, std::abs(values(nearest) - pole) / (std::max(1.0, std::abs(pole)) * sensitivity));
  }
  return largest;
}

/// n poles left of the imaginary axis (or in the unit circle), some in pairs.
Eigen::VectorXcd random_poles(Random& random, Eigen::Index n) {
  Eigen::VectorXcd poles(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (i + 1 < n && random.uniform() < 0.4) {
      poles(i) = Complex(-random.uniform(0.2, 3.0), random.uniform(0.1, 3.0));
      poles(i + 1) = std::conj(poles(i));
      ++i;
    } else {
      poles(i) = -random.uniform(0.2, 4.0);
    }
  }
  return poles;
}

// A double integrator: s² + k₂ s + k₁ = (s + 1)(s + 2).
TEST(Place, DoubleIntegrator) {
  Eigen::Matrix2d A;
  A << 0.0, 1.0, 0.0, 0.0;
  const auto placed = place(A, Eigen::Vector2d(0.0, 1.0), {-1.0, -2.0}).value();
  EXPECT_NEAR(placed.K(0, 0), 2.0, 1e-15);
  EXPECT_NEAR(placed.K(0, 1), 3.0, 1e-15);
  EXPECT_NEAR(placed.poles(0).real(), -1.0, 1e-14);
  EXPECT_NEAR(placed.poles(1).real(), -2.0, 1e-14);
  // V = [1 1; -1 -2] with unit columns: κ = 6.1623.
  EXPECT_NEAR(placed.condition, 6.162277660168381, 1e-9);
}

// x₊ = x + T v, v₊ = v + T u: u = -(x + 2 T v)/T² stops it in two steps.
TEST(Place, DeadbeatStopsInTwoSteps) {
  const auto elevator = mechanisms::elevator({.kS = 0.0, .kV = 4.0, .kA = 0.3, .kG = 0.0}).value();
  const auto plant = discretize(elevator, 20_ms).value();
  const auto placed = deadbeat(plant).value();
  static_assert(decltype(placed.K)::ColsAtCompileTime == 2);
  const Eigen::Matrix2d closed = plant.A - plant.B * placed.K;
  EXPECT_LT((closed * closed).norm(), 1e-12);
}

TEST(Place, IsTheReferences) {
  std::ifstream stream(std::string(FLYBALL_PROJECT_DATA) + "/pole_placement.json");
  const auto cases = nlohmann::json::parse(stream).at("cases");
  ASSERT_GE(cases.size(), 11u);
  for (const auto& one : cases) {
    SCOPED_TRACE(one.at("name").get<std::string>());
    const Eigen::MatrixXd A = matrix_from(one.at("A"));
    const Eigen::MatrixXd B = matrix_from(one.at("B"));
    const Eigen::VectorXcd poles = poles_from(one.at("poles"));
    const auto placed = place(A, B, poles);
    if (!one.at("reachable").get<bool>()) {
      ASSERT_FALSE(placed.has_value());
      EXPECT_TRUE(placed.error().is(PolePlacementError::not_controllable));
      continue;
    }
    ASSERT_TRUE(placed.has_value()) << to_string(placed.error());
    RecordProperty(one.at("name").get<std::string>() + "_condition",
                   std::to_string(placed->condition));
    EXPECT_LT(worst(A - B * placed->K, poles), 1e-10);
    EXPECT_LT(placed->K.norm(), 1.3 * one.at("best_peer_norm").get<double>());
    if (B.cols() > 1 && one.contains("best_peer_condition")) {
      EXPECT_LT(placed->condition, 1.05 * one.at("best_peer_condition").get<double>());
    }
    if (one.contains("K")) {
      const auto gold = one.at("K").get<std::vector<double>>();
      const Eigen::Map<const Eigen::RowVectorXd> K(gold.data(), A.rows());
      EXPECT_LT((placed->K - K).norm(), 4e-16 * K.norm());
    }
  }
}

// Over seeded plants of every shape: what is placed is where it was asked for.
TEST(Place, RandomPlants) {
  Random random(3);
  int refused = 0;
  constexpr int trials = 2000;
  for (int trial = 0; trial < trials; ++trial) {
    const Eigen::Index n = 1 + trial % 8;
    const Eigen::Index m = 1 + (trial / 8) % std::min<Eigen::Index>(n, 4);
    const Eigen::MatrixXd A = random_matrix(random, n, n);
    const Eigen::MatrixXd B = random_matrix(random, n, m);
    const Eigen::VectorXcd poles = random_poles(random, n);
    const auto placed = place(A, B, poles);
    if (!placed) {
      ++refused;
      continue;
    }
    ASSERT_LT(worst(A - B * placed->K, poles), 1e-8) << "trial " << trial;
    ASSERT_LE((placed->poles - poles).cwiseQuotient(poles).cwiseAbs().maxCoeff(),
              placed->pole_error * 1.0001);
  }
  EXPECT_EQ(refused, 0);
}

// Badly scaled states and inputs (1e±8), judged in units that are not.
TEST(Place, BadlyScaledPlants) {
  Random random(4);
  int refused = 0;
  constexpr int trials = 500;
  for (int trial = 0; trial < trials; ++trial) {
    const Eigen::Index n = 2 + trial % 4;
    const Eigen::Index m = 1 + trial % 2;
    Eigen::VectorXd d(n);
    for (double& entry : d) {
      entry = std::pow(10.0, random.uniform(-8.0, 8.0));
    }
    const Eigen::MatrixXd A =
        d.asDiagonal() * random_matrix(random, n, n) * d.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd B =
        d.asDiagonal() * random_matrix(random, n, m) * std::pow(10.0, random.uniform(-8.0, 8.0));
    const Eigen::VectorXcd poles = random_poles(random, n);
    const auto placed = place(A, B, poles);
    if (!placed) {
      ++refused;
      continue;
    }
    const Eigen::MatrixXd scaled =
        d.cwiseInverse().asDiagonal() * (A - B * placed->K) * d.asDiagonal();
    ASSERT_LT(worst(scaled, poles), 1e-8) << "trial " << trial;
  }
  EXPECT_EQ(refused, 0);
}

// As often as B has independent columns, the closed loop stays diagonalisable.
TEST(Place, RepeatedAsOftenAsThereAreInputs) {
  Random random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::MatrixXd A = random_matrix(random, 4, 4);
    const Eigen::MatrixXd B = random_matrix(random, 4, 2);
    const auto placed = place(A, B, {-2.0, -2.0, -3.0, -3.0}).value();
    ASSERT_LT(worst(A - B * placed.K, placed.poles), 1e-10);
    ASSERT_LT(placed.pole_error, 1e-6 * placed.condition);
    // (M + 2)(M + 3) = 0 only without chains.
    const Eigen::Matrix4d M = A - B * placed.K;
    const Eigen::Matrix4d I = Eigen::Matrix4d::Identity();
    ASSERT_LT(((M + 2.0 * I) * (M + 3.0 * I)).norm(), 1e-11 * placed.condition * M.squaredNorm());
  }
}

// Above that it cannot be, but the poles are there all the same: for two inputs and four states all
// at p, (A - BK - p)ⁿ = 0.
TEST(Place, RepeatedMoreOften) {
  Random random(6);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Index n = 2 + trial % 5;
    const Eigen::Index m = 1 + trial % 2;
    const Eigen::MatrixXd A = random_matrix(random, n, n);
    const Eigen::MatrixXd B = random_matrix(random, n, m);
    const double pole = trial % 3 == 0 ? 0.0 : -random.uniform(0.5, 2.0);
    const auto placed = place(A, B, Eigen::VectorXcd::Constant(n, pole)).value();
    const Eigen::MatrixXd M = A - B * placed.K - pole * Eigen::MatrixXd::Identity(n, n);
    Eigen::MatrixXd power = Eigen::MatrixXd::Identity(n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      power = (power * M).eval();
    }
    ASSERT_LT(power.norm(), 1e-12 * std::pow(M.norm() + A.norm(), static_cast<double>(n))) << trial;
  }
}

// Repeated complex pairs, one input and two.
TEST(Place, RepeatedPairs) {
  Random random(7);
  const Eigen::VectorXcd poles =
      (Eigen::VectorXcd(4) << Complex(-1, 2), Complex(-1, -2), Complex(-1, 2), Complex(-1, -2))
          .finished();
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::MatrixXd A = random_matrix(random, 4, 4);
    const Eigen::MatrixXd B = random_matrix(random, 4, 1 + trial % 3);
    const auto placed = place(A, B, poles).value();
    const Eigen::Matrix4d M = A - B * placed.K;
    const Eigen::Matrix4d factor = M * M + 2.0 * M + 5.0 * Eigen::Matrix4d::Identity();
    const double size = std::pow(M.norm(), 4.0) + 25.0;
    ASSERT_LT((factor * factor).norm(), 1e-11 * size) << trial;
  }
}

// As many inputs as states: any closed loop can be had, so a normal one is.
TEST(Place, AsManyInputsAsStates) {
  Random random(8);
  const Eigen::MatrixXd A = random_matrix(random, 5, 5);
  const Eigen::MatrixXd B = random_matrix(random, 5, 5);
  const auto placed = place(A, B, {-1.0, -2.0, Complex(-3, 1), Complex(-3, -1), -1.0}).value();
  EXPECT_NEAR(placed.condition, 1.0, 1e-6);
}

// Columns of B that depend on each other count once.
TEST(Place, RedundantInputs) {
  Eigen::Matrix2d A;
  A << 0.0, 1.0, 2.0, 0.0;
  Eigen::Matrix2d B;
  B << 0.0, 0.0, 1.0, 2.0;
  const auto placed = place(A, B, {-1.0, -1.0}).value();
  EXPECT_LT(placed.pole_error, 1e-7);
  // The smallest gain shares the work in the ratio of the columns.
  EXPECT_NEAR(placed.K(1, 0), 2.0 * placed.K(0, 0), 1e-12);
  EXPECT_NEAR(placed.K(0, 0) + 2.0 * placed.K(1, 0), 3.0, 1e-12);
}

// An observer: L = place(Aᵀ, Cᵀ)ᵀ.
TEST(Place, ObserverByDuality) {
  Random random(9);
  const Eigen::MatrixXd A = random_matrix(random, 3, 3);
  const Eigen::MatrixXd C = random_matrix(random, 1, 3);
  const auto placed = place(A.transpose(), C.transpose(), {-5.0, -6.0, -7.0}).value();
  const Eigen::VectorXcd poles = (Eigen::VectorXcd(3) << -5.0, -6.0, -7.0).finished();
  EXPECT_LT(worst(A - placed.K.transpose() * C, poles), 1e-10);
}

TEST(Place, FixedIsDynamic) {
  const auto elevator = mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
  const Eigen::VectorXcd poles = (Eigen::VectorXcd(2) << -5.0, -6.0).finished();
  const auto fixed = place(elevator, poles).value();
  static_assert(decltype(fixed.K)::RowsAtCompileTime == 1);
  EXPECT_EQ(Eigen::MatrixXd(fixed.K), place(elevator.A, elevator.B, poles).value().K);
}

// A mode that no input reaches stays where it is if that is what was asked for.
TEST(Place, KeepsWhatNothingReaches) {
  Random random(10);
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Index n = 4;
    Eigen::MatrixXd A = random_matrix(random, n, n);
    A.bottomLeftCorner(1, 3).setZero();
    A(3, 3) = -0.7;
    Eigen::MatrixXd B = random_matrix(random, n, 1 + trial % 2);
    B.row(3).setZero();
    const Eigen::MatrixXd turn = test::random_rotation(random, n);
    A = (turn * A * turn.transpose()).eval();
    B = (turn * B).eval();
    const auto placed = place(A, B, {-1.0, -0.7, -2.0, -3.0});
    ASSERT_TRUE(placed.has_value()) << to_string(placed.error());
    ASSERT_EQ(placed->uncontrollable.size(), 1u);
    EXPECT_NEAR(placed->uncontrollable.front().real(), -0.7, 1e-11);
    EXPECT_LT(worst(A - B * placed->K, placed->poles), 1e-8);
    EXPECT_LT(placed->pole_error, 1e-8 * placed->condition);
    const auto refused = place(A, B, {-1.0, -0.9, -2.0, -3.0});
    ASSERT_FALSE(refused.has_value());
    EXPECT_TRUE(refused.error().is(PolePlacementError::not_controllable));
    EXPECT_NEAR(refused.error().evidence().front().values.front(), -0.7, 1e-11);
  }
}

TEST(Place, NamesTheModeAndItsState) {
  const Eigen::Matrix2d A = Eigen::Vector2d(1.0, 2.0).asDiagonal();
  const auto refused = place(A, Eigen::Vector2d(1.0, 0.0), {-1.0, -2.0});
  ASSERT_FALSE(refused.has_value());
  EXPECT_TRUE(refused.error().is(PolePlacementError::not_controllable));
  EXPECT_EQ(refused.error().kind(), ErrorKind::no_answer);
  EXPECT_EQ(refused.error().where(), "place");
  ASSERT_EQ(refused.error().evidence().size(), 2u);
  EXPECT_EQ(refused.error().evidence()[0].values, (std::vector<double>{2.0, 0.0}));
  EXPECT_EQ(refused.error().evidence()[1].text, "1");
  // Nothing is reached at all.
  EXPECT_TRUE(place(A, Eigen::Vector2d(0.0, 0.0), {-1.0, -2.0})
                  .error()
                  .is(PolePlacementError::not_controllable));
  const auto kept = place(A, Eigen::Vector2d(0.0, 0.0), {2.0, 1.0}).value();
  EXPECT_EQ(kept.K, Eigen::MatrixXd::Zero(1, 2));
}

TEST(Place, Errors) {
  const Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
  const Eigen::Vector2d B(1.0, 0.0);
  const auto count = place(A, B, {-1.0});
  EXPECT_EQ(to_string(count.error()), "place: poles is 1 numbers; it must be one pole a state (2)");
  EXPECT_TRUE(place(Eigen::MatrixXd(0, 0), B, {}).error().is(ArgumentError::empty));
  EXPECT_TRUE(place(A, Eigen::MatrixXd(2, 0), {-1.0, -2.0}).error().is(ArgumentError::empty));
  EXPECT_TRUE(
      place(A, Eigen::Vector3d::Zero(), {-1.0, -2.0}).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      place(Eigen::MatrixXd::Zero(2, 3), B, {-1.0, -2.0}).error().is(ArgumentError::wrong_shape));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(place(A * nan, B, {-1.0, -2.0}).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(place(A, B * nan, {-1.0, -2.0}).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(place(A, B, {-1.0, nan}).error().is(ArgumentError::not_finite));
  const auto lonely = place(A, B, {Complex(-1, 2), -2.0});
  EXPECT_TRUE(lonely.error().is(PolePlacementError::not_conjugate));
  EXPECT_EQ(lonely.error().kind(), ErrorKind::misuse);
  EXPECT_EQ(lonely.error().evidence().front().values, (std::vector<double>{-1.0, 2.0}));
  EXPECT_TRUE(place(A, B, {Complex(-1, -2), -2.0}).error().is(PolePlacementError::not_conjugate));
}

// One of six modes is coupled by 1e-14: in turned coordinates that is what rounding made of it.
TEST(Place, RefusesWhatOnlyRoundingReaches) {
  const Eigen::Index n = 6;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    A(i, i) = static_cast<double>(i + 1);
  }
  Random random(11);
  const Eigen::MatrixXd turn = test::random_rotation(random, n);
  Eigen::MatrixXd b = Eigen::VectorXd::Ones(n);
  b(n - 1) = 1e-16;
  const auto placed = place(turn * A * turn.transpose(), turn * b, {-1, -2, -3, -4, -5, -6});
  ASSERT_FALSE(placed.has_value());
  EXPECT_TRUE(placed.error().is(PolePlacementError::not_controllable));
  EXPECT_NEAR(placed.error().evidence().front().values.front(), 6.0, 1e-12);
}

// Two inputs of which only differences of 1e-10 reach the second state: the sum that leaves the
// first alone is large, and each entry of K rounded by 1e-6 for itself would move the first.
TEST(Place, LargeGainsAreRoundedTogether) {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(0.7).toRotationMatrix();
  const Eigen::Matrix2d A = turn * Eigen::Vector2d(0.3, 0.9).asDiagonal() * turn.transpose();
  Eigen::Matrix2d B;
  B << 1.0, 0.7, 1e-10, -0.3e-10;
  const auto placed = place(A, turn * B, {-1.0, -2.0}).value();
  EXPECT_GT(placed.K.cwiseAbs().minCoeff(), 1e9);
  EXPECT_LT(placed.condition, 2.0);
  EXPECT_LT(placed.pole_error, 2e-9);
}

// A mode that no input reaches, 1e300, stays: in whatever units, it is neither lost nor a pole at
// 0.
TEST(Place, KeepsModesBeyondAllOthers) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(3, 3);
  A << 1.5, 1e-155, -1e154, 0.0, 0.6, -1.5, 0.0, 0.0, 1e300;
  const Eigen::MatrixXd B = Eigen::Vector3d(0.0, 1.7, 0.0);
  const auto lost = place(A, B, {-0.1, Complex(-0.1, 1e20), Complex(-0.1, -1e20)});
  ASSERT_FALSE(lost.has_value());
  EXPECT_TRUE(lost.error().is(PolePlacementError::not_controllable));
  EXPECT_NEAR(lost.error().evidence().front().values.front() / 1e300, 1.0, 1e-12);
  // To move 1e154 with an input of 1e-300 takes more than a double.
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  EXPECT_TRUE(place(1e154 * one, 1e-300 * one, {1.0}).error().is(PolePlacementError::not_reached));
}

// An input of 1e155 must not choose units in which the poles are nothing and K = 0 reaches them.
TEST(Place, ALargeInputDoesNotHideAModeThatIsNotReached) {
  const Eigen::Matrix3d A{{1.25, 1.625, 0.0}, {0.0, 1.25, 1.625}, {0.0, 0.0, 1.25}};
  const Eigen::MatrixXd B{{-3.0, 1e155}, {0.0, -3.0}, {0.0, 0.0}};
  const auto placed = place(A, B, {0.2, 0.5, 0.6});
  ASSERT_FALSE(placed);
  EXPECT_TRUE(placed.error().is(PolePlacementError::not_controllable));
}

}  // namespace
}  // namespace flyball::pole_placement_test
