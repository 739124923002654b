#include <flyball/mechanisms/kinematics/swerve_kinematics.hpp>

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "support/allocation_count.hpp"
#include "support/oracle.hpp"

namespace flyball::mechanisms::swerve_kinematics_test {
namespace {

using Four = std::array<Eigen::Vector2d, 4>;
const Four square{Eigen::Vector2d(0.3, 0.25), {0.3, -0.25}, {-0.3, 0.25}, {-0.3, -0.25}};

// book_reference.json, swerve_11.7.
TEST(SwerveKinematics, OfTheBook) {
  const auto kinematics = swerve_kinematics(square).value();
  const auto modules = kinematics.modules({1.2, -0.4, 0.7});
  const double book[4][2] = {{1.0424610304467021, -0.1832854897497907},
                             {1.388065200197743, -0.13731226757456877},
                             {1.1927803653648896, -0.5368249794469454},
                             {1.504235686320465, -0.41754933811913536}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(modules[i].speed, book[i][0], 1e-15);
    EXPECT_NEAR(modules[i].angle.angle(), book[i][1], 1e-15);
  }
}

/// M of (11.14): rows x and y of each module.
template <std::size_t N>
Eigen::MatrixXd inverse_kinematics_matrix(const std::array<Eigen::Vector2d, N>& positions) {
  Eigen::MatrixXd M(2 * N, 3);
  for (std::size_t i = 0; i < N; ++i) {
    const auto row = static_cast<Eigen::Index>(2 * i);
    M.middleRows<2>(row) << 1.0, 0.0, -positions[i](1), 0.0, 1.0, positions[i](0);
  }
  return M;
}

template <std::size_t N>
void expect_laws(Random& random) {
  std::array<Eigen::Vector2d, N> positions;
  for (auto& r : positions) {
    r = {random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)};
  }
  const auto kinematics = swerve_kinematics(positions).value();
  const ChassisSpeeds speeds{random.uniform(-4.0, 4.0), random.uniform(-4.0, 4.0),
                             random.uniform(-9.0, 9.0)};
  auto modules = kinematics.modules(speeds);
  EXPECT_LE((kinematics.chassis(modules).vector() - speeds.vector()).norm(), 1e-12);
  // About another point: its speeds are the ones given.
  const Eigen::Vector2d centre(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
  const auto about = kinematics.chassis(kinematics.modules(speeds, {}, centre)).at(centre);
  EXPECT_LE((about.vector() - speeds.vector()).norm(), 1e-12);

  // Of modules that contradict each other: (11.17) by Eigen's orthogonal decomposition.
  Eigen::Vector<double, 2 * N> v;
  Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(2 * N, 2 * N);
  constexpr double distance_variance = 0.01;
  constexpr double angle_variance = 0.003;
  for (std::size_t i = 0; i < N; ++i) {
    modules[i] = {random.uniform(-4.0, 4.0), Rotation2d(random.uniform(-3.0, 3.0))};
    const Eigen::Matrix2d R = modules[i].angle.matrix();
    const auto row = static_cast<Eigen::Index>(2 * i);
    v.template segment<2>(row) = R.col(0) * modules[i].speed;
    noise.block<2, 2>(row, row) =
        R *
        Eigen::Vector2d(distance_variance, angle_variance * modules[i].speed * modules[i].speed)
            .asDiagonal() *
        R.transpose();
  }
  const Eigen::MatrixXd F = test::pseudo_inverse(inverse_kinematics_matrix(positions));
  EXPECT_LE((kinematics.twist(modules) - F * v).norm(), 1e-13 * F.norm() * v.norm());
  EXPECT_LE((kinematics.twist_covariance(modules, distance_variance, angle_variance) -
             F * noise * F.transpose())
                .norm(),
            1e-13 * F.squaredNorm() * noise.norm());
}

TEST(SwerveKinematics, ForwardIsTheLeastSquaresInverse) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    expect_laws<2>(random);
    expect_laws<3>(random);
    expect_laws<4>(random);
    expect_laws<5>(random);
    expect_laws<6>(random);
    expect_laws<7>(random);
    expect_laws<8>(random);
  }
}

// A module that stands still keeps its direction; one at the centre of a turn does.
TEST(SwerveKinematics, StandingModulesHoldTheirAngles) {
  const auto kinematics = swerve_kinematics(square).value();
  SwerveKinematics<4>::Modules held;
  for (std::size_t i = 0; i < 4; ++i) {
    held[i].angle = Rotation2d(0.1 * static_cast<double>(i + 1));
  }
  const auto still = kinematics.modules({}, held);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(still[i].speed, 0.0);
    EXPECT_EQ(still[i].angle.angle(), held[i].angle.angle());
  }
  const auto about = kinematics.modules({0.0, 0.0, 1.0}, held, square[2]);
  EXPECT_EQ(about[2].angle.angle(), held[2].angle.angle());
  EXPECT_NEAR(about[0].angle.angle(), std::acos(0.0), 1e-15);  // beside it: straight to the left
}

TEST(SwerveKinematics, RefusesModulesInOnePlace) {
  const Eigen::Vector2d place(0.3, 0.2);
  EXPECT_EQ(to_string(swerve_kinematics(std::array{place, place, place}).error()),
            "swerve_kinematics: positions is (0.3 m, 0.2 m) of modules 1 and 2 both; it must be "
            "modules in different places; give each module its own place in the robot's frame, x "
            "forward and y left");
  // Two of three: a motion could be told, but no robot is built so.
  EXPECT_TRUE(swerve_kinematics(std::array{place, Eigen::Vector2d(0.0, 0.1), place})
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(swerve_kinematics(std::array{place, Eigen::Vector2d(0.0, NAN)})
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_TRUE(swerve_kinematics(std::array{place, Eigen::Vector2d(0.3, 0.2001)}));
}

TEST(SwerveKinematics, AllocatesNothing) {
  const auto kinematics = swerve_kinematics(square).value();
  const test::AllocationCounter counter;
  SwerveKinematics<4>::Modules modules;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 100; ++k) {
    modules = kinematics.modules({1.0, 0.5, 0.1 * k}, modules);
    sum += kinematics.twist(modules);
  }
  EXPECT_TRUE(sum.allFinite());
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
}

}  // namespace
}  // namespace flyball::mechanisms::swerve_kinematics_test
