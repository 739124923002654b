// Over thousands of random plants no gain claims poles that it does not have, judged in extended
// precision, and next to none that can be placed is refused.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/control/pole_placement.hpp>
#include <flyball/core/random.hpp>

#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::pole_placement_property_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Extended = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using ExtendedComplex = Eigen::Matrix<std::complex<long double>, Eigen::Dynamic, Eigen::Dynamic>;

MatrixXd random_matrix(Random& random, Index rows, Index columns) {
  return MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

MatrixXd random_turn(Random& random, Index n) {
  return test::random_rotation(random, n);
}

double random_power(Random& random, double least, double most) {
  return std::pow(10.0, random.uniform(least, most));
}

/// A unit of up to so many decades; a power of two, so that no entry is rounded by it.
double random_unit(Random& random, double decades) {
  return std::exp2(std::round(random.uniform(-decades, decades) * std::log2(10.0)));
}

/// A plant, the poles, and the units of its states in which it is of one size.
struct Problem {
  MatrixXd A;
  MatrixXd B;
  Eigen::VectorXcd poles;
  VectorXd units;

  [[nodiscard]] MatrixXd A_fair() const {
    return units.cwiseInverse().asDiagonal() * A * units.asDiagonal();
  }
  [[nodiscard]] MatrixXd B_fair() const { return units.cwiseInverse().asDiagonal() * B; }

  void turn(Random& random) {
    const MatrixXd Q = random_turn(random, A.rows());
    A = (Q * A * Q.transpose()).eval();
    B = (Q * B).eval();
  }
  void scale(Random& random, double decades) {
    for (double& unit : units) {
      unit = random_unit(random, decades);
    }
    A = (units.asDiagonal() * A * units.cwiseInverse().asDiagonal()).eval();
    B = (units.asDiagonal() * B).eval();
    for (Index j = 0; j < B.cols(); ++j) {
      B.col(j) *= random_unit(random, decades);
    }
  }
};

/// Stable and unstable ones.
Problem ordinary(Random& random, Index n, Index m) {
  Problem problem{random_matrix(random, n, n), random_matrix(random, n, m), Eigen::VectorXcd(n),
                  VectorXd::Ones(n)};
  problem.A.diagonal().array() += random.uniform(-4.0, 4.0);
  for (Index i = 0; i < n; ++i) {
    problem.poles(i) = -random.uniform(0.2, 4.0);
    if (i + 1 < n && random.uniform() < 0.4) {
      problem.poles(i).imag(random.uniform(0.1, 3.0));
      problem.poles(i + 1) = std::conj(problem.poles(i));
      ++i;
    }
  }
  return problem;
}

/// 1 to 5 states, 1 to 3 inputs.
Problem ordinary(Random& random, int trial) {
  const Index n = 1 + trial % 5;
  return ordinary(random, n, 1 + (trial / 5) % std::min<Index>(n, 3));
}

/// The last states are coupled to the others and to the inputs by 1e-3 to 1e-10.
Problem nearly_uncontrollable(Random& random, int trial) {
  Problem problem = ordinary(random, trial);
  const Index n = problem.A.rows();
  const double coupling = random_power(random, -10.0, -3.0);
  const Index weak = 1 + trial % std::max<Index>(n - 1, 1);
  problem.A.bottomLeftCorner(weak, n - weak) *= coupling;
  problem.B.bottomRows(weak) *= coupling;
  problem.turn(random);
  return problem;
}

/// Each mode reaches the inputs by 1 to 1e-10.
Problem weak_modes(Random& random, int trial) {
  Problem problem = ordinary(random, trial);
  const Index n = problem.A.rows();
  problem.A.setZero();
  for (Index i = 0; i < n; ++i) {
    problem.A(i, i) = random.uniform(-3.0, 3.0);
    problem.B.row(i) *= random_power(random, -10.0, 0.0);
  }
  problem.turn(random);
  return problem;
}

/// The smallest singular value of [A - λ, B], all of size one, over the eigenvalues λ.
double distance_to_uncontrollable(const MatrixXd& A, const MatrixXd& B) {
  const Index n = A.rows();
  double smallest = std::numeric_limits<double>::infinity();
  for (const Complex& mode : test::eigenvalues(A)) {
    Eigen::MatrixXcd pencil(n, n + B.cols());
    pencil << A.cast<Complex>() / A.norm(), B.colwise().normalized().cast<Complex>();
    pencil.diagonal().array() -= mode / A.norm();
    smallest = std::min(smallest, test::singular_values(pencil)(n - 1));
  }
  return smallest;
}

/// How far A - B K is from a matrix with each of the poles, the largest of σ_min(A - B K - p I) in
/// units of max(1, |p|): that of a pole which is off by δ is δ over the pole's condition. Unlike an
/// eigenvalue it is not lost where A - B K is large and far from normal.
double misplaced(const MatrixXd& A, const MatrixXd& B, const MatrixXd& K,
                 const Eigen::VectorXcd& wanted) {
  const Extended closed = A.cast<long double>() - B.cast<long double>() * K.cast<long double>();
  double largest = 0.0;
  for (const Complex& pole : wanted) {
    ExtendedComplex shifted = closed.cast<std::complex<long double>>();
    shifted.diagonal().array() -= std::complex<long double>(pole.real(), pole.imag());
    const Eigen::PartialPivLU<ExtendedComplex> factor(shifted);
    // √n/‖M⁻¹‖_F is at least the smallest singular value.
    const auto size = static_cast<double>(factor.inverse().norm());
    const double smallest =
        std::isfinite(size) ? std::sqrt(static_cast<double>(A.rows())) / size : 0.0;
    largest = std::max(largest, smallest / std::max(1.0, std::abs(pole)));
  }
  return largest;
}

/// What came of many problems.
struct Tally {
  int problems = 0;
  int refused = 0;
  double worst = 0.0;

  void add(const Problem& problem) {
    constexpr double rounding = 1e3 * std::numeric_limits<double>::epsilon();
    ++problems;
    const auto placed = place(problem.A, problem.B, problem.poles);
    const MatrixXd A = problem.A_fair();
    const MatrixXd B = problem.B_fair();
    if (!placed) {
      refused += distance_to_uncontrollable(A, B) > rounding * static_cast<double>(A.rows());
      return;
    }
    ASSERT_TRUE(placed->K.allFinite());
    const MatrixXd K = placed->K * problem.units.asDiagonal();
    const double here = misplaced(A, B, K, problem.poles);
    // What extended precision itself cannot tell.
    const double noise = 4.0 * static_cast<double>(std::numeric_limits<long double>::epsilon()) *
                         static_cast<double>(A.rows()) * (A.norm() + B.norm() * K.norm());
    worst = std::max(worst, here - noise);
    ASSERT_LT(here, 1e-8 + noise) << "problem " << problems;
  }
};

void expect_placed(const Tally& tally) {
  EXPECT_LE(tally.refused, tally.problems / 200);
  ::testing::Test::RecordProperty("refused", tally.refused);
  ::testing::Test::RecordProperty("worst", std::to_string(tally.worst));
}

TEST(PlaceProperty, OrdinaryPlants) {
  Random random(21);
  Tally tally;
  for (int trial = 0; trial < 3000 && !HasFatalFailure(); ++trial) {
    tally.add(ordinary(random, trial));
  }
  expect_placed(tally);
}

TEST(PlaceProperty, LargerPlants) {
  Random random(27);
  Tally tally;
  for (Index n = 11; n <= 30 && !HasFatalFailure(); ++n) {
    tally.add(ordinary(random, n, 3 + n % 4));
  }
  tally.add(ordinary(random, 50, 12));
  expect_placed(tally);
}

// One input and thirty states, two and fifty: to move all poles takes a K whose rounding moves them
// again. An answer is stable, as it was asked to be, and says where the poles are; or there is
// none.
TEST(PlaceProperty, TooFewInputs) {
  Random random(28);
  int refused = 0;
  for (int trial = 0; trial < 12; ++trial) {
    SCOPED_TRACE(trial);
    const bool fifty = trial % 4 == 3;
    const Problem problem =
        ordinary(random, fifty ? 50 : 11 + 2 * trial, fifty ? 2 : 1 + trial % 2);
    const auto placed = place(problem.A, problem.B, problem.poles);
    if (!placed) {
      EXPECT_EQ(placed.error().kind(), ErrorKind::no_answer);
      EXPECT_FALSE(placed.error().evidence().empty());
      ++refused;
      continue;
    }
    EXPECT_LT(placed->poles.real().maxCoeff(), 0.0);
    EXPECT_LT(misplaced(problem.A, problem.B, placed->K, problem.poles),
              1e-8 + 1e-17 * problem.B.norm() * placed->K.norm());
    EXPECT_GE(placed->pole_error * (1.0 + 1e-12),
              (placed->poles - problem.poles).cwiseQuotient(problem.poles).cwiseAbs().maxCoeff());
  }
  EXPECT_GE(refused, 1);
  ::testing::Test::RecordProperty("refused", refused);
}

TEST(PlaceProperty, BadlyScaledPlants) {
  Random random(22);
  Tally tally;
  for (int trial = 0; trial < 2000 && !HasFatalFailure(); ++trial) {
    Problem problem = ordinary(random, trial);
    problem.scale(random, 8.0);
    tally.add(problem);
  }
  expect_placed(tally);
}

TEST(PlaceProperty, NearlyUncontrollablePlants) {
  Random random(23);
  Tally tally;
  for (int trial = 0; trial < 2500 && !HasFatalFailure(); ++trial) {
    tally.add(nearly_uncontrollable(random, trial));
  }
  expect_placed(tally);
}

TEST(PlaceProperty, NearlyUncontrollableAndBadlyScaledPlants) {
  Random random(24);
  Tally tally;
  for (int trial = 0; trial < 1000 && !HasFatalFailure(); ++trial) {
    Problem problem = nearly_uncontrollable(random, trial);
    problem.scale(random, 8.0);
    tally.add(problem);
  }
  expect_placed(tally);
}

TEST(PlaceProperty, WeakModes) {
  Random random(25);
  Tally tally;
  for (int trial = 0; trial < 1500 && !HasFatalFailure(); ++trial) {
    tally.add(weak_modes(random, trial));
  }
  expect_placed(tally);
}

// The reference cases turned at random, and in other units.
TEST(PlaceProperty, TurnedAndScaledReferences) {
  std::ifstream stream(FLYBALL_PROJECT_DATA "/pole_placement.json");
  const auto cases = nlohmann::json::parse(stream).at("cases");
  const auto matrix = [](const nlohmann::json& rows) {
    MatrixXd M(static_cast<Index>(rows.size()), static_cast<Index>(rows.at(0).size()));
    for (Index i = 0; i < M.rows(); ++i) {
      for (Index j = 0; j < M.cols(); ++j) {
        M(i, j) =
            rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j)).get<double>();
      }
    }
    return M;
  };
  Random random(26);
  Tally tally;
  int kept_refusing = 0;
  for (const auto& one : cases) {
    Problem given{matrix(one.at("A")), matrix(one.at("B")), {}, {}};
    const MatrixXd poles = matrix(one.at("poles"));
    given.poles = poles.col(0) + Complex(0.0, 1.0) * poles.col(1);
    given.units = VectorXd::Ones(given.A.rows());
    if (given.A.rows() > 10) {
      continue;
    }
    for (int trial = 0; trial < 100 && !HasFatalFailure(); ++trial) {
      Problem problem = given;
      if (trial % 2 == 0) {
        problem.turn(random);
      } else {
        problem.scale(random, 4.0);
      }
      if (one.at("reachable").get<bool>()) {
        tally.add(problem);
      } else {
        const auto refused = place(problem.A, problem.B, problem.poles);
        kept_refusing +=
            !refused && refused.error().is(PolePlacementError::not_controllable) ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(kept_refusing, 100);
  expect_placed(tally);
}

}  // namespace
}  // namespace flyball::pole_placement_property_test
