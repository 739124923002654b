#pragma once

#include <functional>
#include <string>

#include <flyball/control/followers/ltv_drive.hpp>

#include "book/drawing.hpp"

/// The drive, the trajectory and the loop of Figures 8.4 to 8.13.
namespace flyball::book {

/// x, y, heading, left and right velocity.
using DriveVector = Eigen::Vector<double, 5>;

inline constexpr Time drive_period{0.02};
inline constexpr Length drive_trackwidth{0.59055};

/// Three CIM motors a side.
[[nodiscard]] mechanisms::DifferentialDrive case_study_drive();

/// The drive with its place on the field, (8.11): a model, which is simulated and linearised.
struct FieldDrive {
  mechanisms::DifferentialDrive drive = case_study_drive();

  static constexpr int states() { return 5; }
  static constexpr int inputs() { return 2; }
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    using Scalar = ScalarOf<X, U>;
    const Scalar v = 0.5 * (x(3) + x(4));
    const auto sides = drive.derivative(Eigen::Vector<Scalar, 2>(x(3), x(4)), u);
    return Eigen::Vector<Scalar, 5>{v * cos(x(2)), v * sin(x(2)),
                                    (x(4) - x(3)) / drive_trackwidth.si(), sides(0), sides(1)};
  }
};

/// The voltages that a controller adds to the feedforward. @param x, r  The state and the
/// reference now.
using DriveFeedback = std::function<Eigen::Vector2d(const DriveVector& x, const DriveVector& r)>;

/// How the drive moves over a period.
enum class DriveMotion { dormand_prince, first_order };

/// A drive that starts half a metre beside its path, across it. One column a sample.
struct FollowedTrajectory {
  Eigen::MatrixXd r;  ///< 5 x samples
  Eigen::MatrixXd x;  ///< 5 x samples
  Eigen::MatrixXd u;  ///< 2 x samples
};
[[nodiscard]] FollowedTrajectory follow(const DriveFeedback& feedback,
                                        DriveMotion motion = DriveMotion::dormand_prince);

/// The columns of a run after the time, and its two pictures. @param suffix  Of the columns' names;
/// references have none.
void add_run(FigureResult& figure, const FollowedTrajectory& run, const std::string& suffix = {});
/// y over x.
[[nodiscard]] Plot path_plot(const FigureResult& figure);
/// States and inputs over time.
[[nodiscard]] Plot drive_response_plot(const FigureResult& figure);

/// A figure of one run: its path, or its states and inputs.
[[nodiscard]] FigureResult path_figure(std::string id, std::string title,
                                       const FollowedTrajectory& run);
[[nodiscard]] FigureResult response_figure(std::string id, std::string title,
                                           const FollowedTrajectory& run);

}  // namespace flyball::book
