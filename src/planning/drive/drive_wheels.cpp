#include <cmath>

#include "core/constants.hpp"
#include "planning/drive/drive_body.hpp"
#include "planning/drive/drive_rows.hpp"
#include "planning/drive/drive_rules.hpp"

namespace flyball::drive_transcription {

using Eigen::Index;
using Eigen::VectorXd;
using optimization::Expression;
using optimization::OptimalControlProblem;

namespace {

/// s a unit (m, m/s, rad) that a constraint gives way by: more than what any of them could win.
constexpr double elastic_price = 300.0;
/// s of a segment in which one wheel pushes as hard as it can.
constexpr double force_price = 1e-3;
/// s of a segment with an obstacle's line along the way from its middle.
constexpr double angle_price = 1e-3;

using Vector = optimization::ExpressionVector;

/// Writes what the body does and what its wheels can.
class Writer {
 public:
  Writer(const DriveProblem& problem, const Layout& layout, OptimalControlProblem& ocp)
      : problem_(problem), model_(problem.model), layout_(layout), ocp_(ocp) {}

  void dynamics() {
    const int n = layout_.n;
    // A stage is a step of 1 of what is scaled by its length. Between segments stands a stage of no
    // length in which the duration alone changes.
    ocp_.set_derivative(
        [&](const Vector& x, const Vector& u, const Vector& /*p*/, const Vector& d) {
          std::vector<Expression> slope = drive_body::derivative<Expression>(model_, x, u);
          for (Expression& e : slope) {
            e = x(n) * d(0) * e;
          }
          slope.push_back(u(layout_.change()));
          return slope;
        },
        static_cast<double>(layout_.stages()));
    // Where wheels pull against each other or need not push, any forces would do, and the Hessian
    // is singular: the least ones count.
    ocp_.set_stage_cost(
        [&](const Vector& x, const Vector& u, const Vector& /*p*/, const Vector& d) {
          Expression square = 0.0;
          for (int i = 0; i < layout_.m; ++i) {
            square += u(i) * u(i);
          }
          Expression cost = d(0) * (x(n) + force_price * square);
          for (const std::size_t number : layout_.obstacles) {
            // An obstacle's line is across the way from its middle, where any would do.
            const drive_rules::Disc disc = drive_rules::disc_of(problem_.constraints[number]);
            const Expression a = x(0) - disc.center(0);
            const Expression b = x(1) - disc.center(1);
            const Expression length = sqrt(a * a + b * b + 1e-2);
            const Expression angle = u(layout_.angle(number));
            cost += d(0) * angle_price * (1.0 - (a * cos(angle) + b * sin(angle)) / length);
          }
          return cost;
        });
    if (layout_.elastic) {
      ocp_.set_terminal_cost([&](const Vector& /*x*/, const Vector& /*u*/, const Vector& p) {
        Expression sum = 0.0;
        for (Index i = 0; i < p.size(); ++i) {  // a place to pass is asked for before all else
          sum += (i < layout_.constraints ? elastic_price : 3.0 * elastic_price) * p(i);
        }
        return sum;
      });
    }
  }

  void wheels() {
    const int count = model_.wheel_count();
    const int N = layout_.stages();
    const VectorXd below = VectorXd::Constant(count, -infinity);
    const VectorXd one = VectorXd::Ones(count);
    if (model_.drivetrain == Drivetrain::swerve) {
      ocp_.add_constraint(
          [&](const Vector& /*x*/, const Vector& u) {
            Vector square(count);
            for (int i = 0; i < count; ++i) {
              square(i) = u(2 * i) * u(2 * i) + u(2 * i + 1) * u(2 * i + 1);
            }
            return square;
          },
          below, one, 0, N - 1, "wheel force");
    }
    const double v = model_.max_speed;
    if (model_.drivetrain == Drivetrain::swerve) {
      ocp_.add_constraint(
          [&](const Vector& x, const Vector& /*u*/, const Vector& /*p*/, const Vector& d) {
            Vector square(count);
            for (int i = 0; i < count; ++i) {
              const auto at = drive_body::wheel_velocity<Expression>(model_, x, i);
              square(i) = (at[0] * at[0] + at[1] * at[1]) * (1.0 / (v * v)) + d(1);
            }
            return square;
          },
          below, one, 0, N, "wheel speed");
    } else {
      for (const double sign : {1.0, -1.0}) {
        ocp_.add_constraint(
            [&](const Vector& x, const Vector& /*u*/, const Vector& /*p*/, const Vector& d) {
              Vector speed(count);
              for (int i = 0; i < count; ++i) {
                speed(i) =
                    drive_body::wheel_velocity<Expression>(model_, x, i)[0] * (sign / v) + d(1);
              }
              return speed;
            },
            below, one, 0, N, "wheel speed");
      }
    }
    if (model_.free_speed > 0.0) {
      // Force is held while the speed changes: at both ends of an interval.
      ocp_.add_constraint(
          [&](const Vector& x, const Vector& u, const Vector& /*p*/, const Vector& d) {
            const Vector end = end_of(x, u, d);
            Vector line(2 * count);
            for (int i = 0; i < count; ++i) {
              line(2 * i) = motor_line(x, u, i) + d(2);
              line(2 * i + 1) = motor_line(end, u, i) + d(2);
            }
            return line;
          },
          VectorXd::Constant(2 * count, -infinity), VectorXd::Zero(2 * count), 0, N - 1,
          "motor torque");
    }
    if (model_.supply_power > 0.0) {
      const double F = model_.force();
      const double unit = 1.0 / model_.supply_power;
      ocp_.add_constraint(
          [&](const Vector& x, const Vector& u, const Vector& /*p*/, const Vector& d) {
            const Vector end = end_of(x, u, d);
            Vector power(2 * count);
            for (int i = 0; i < count; ++i) {
              const auto f = drive_body::wheel_force<Expression>(model_, u, i);
              const Expression lost =
                  (f[0] * f[0] + f[1] * f[1]) * (F * F * model_.copper_loss * unit);
              const auto drawn = [&](const Vector& at) {
                const auto speed = drive_body::wheel_velocity<Expression>(model_, at, i);
                return (f[0] * speed[0] + f[1] * speed[1]) * (F * unit) + lost + d(2);
              };
              power(2 * i) = drawn(x);
              power(2 * i + 1) = drawn(end);
            }
            return power;
          },
          VectorXd::Constant(2 * count, -infinity), VectorXd::Ones(2 * count), 0, N - 1,
          "supply power");
    }
    if (model_.drivetrain == Drivetrain::differential && model_.friction > 0.0) {
      // Grip along and across a side.
      const double F = model_.force() / model_.friction;
      const double across = 0.5 * model_.mass / model_.friction;
      ocp_.add_constraint(
          [&](const Vector& x, const Vector& u, const Vector& /*p*/, const Vector& d) {
            const Vector end = end_of(x, u, d);
            Vector grip(2 * count);
            for (int i = 0; i < count; ++i) {
              const auto total = [&](const Vector& at) {
                const Expression turn = (at(4) - at(3)) * (1.0 / model_.trackwidth);
                const Expression side = (at(3) + at(4)) * 0.5 * turn * across;
                return F * F * u(i) * u(i) + side * side + 2.0 * d(2);
              };
              grip(2 * i) = total(x);
              grip(2 * i + 1) = total(end);
            }
            return grip;
          },
          VectorXd::Constant(2 * count, -infinity), VectorXd::Ones(2 * count), 0, N - 1, "grip");
    }
  }

 private:
  /// About where an interval ends.
  [[nodiscard]] Vector end_of(const Vector& x, const Vector& u, const Vector& d) const {
    const auto slope = drive_body::derivative<Expression>(model_, x, u);
    Vector end = x;
    for (std::size_t i = 0; i < slope.size(); ++i) {
      end(static_cast<Index>(i)) += x(layout_.duration()) * d(0) * slope[i];
    }
    return end;
  }

  /// How far a wheel's power is above its motor's line, over stall_force max_speed.
  [[nodiscard]] Expression motor_line(const Vector& x, const Vector& u, int wheel) const {
    const auto v = drive_body::wheel_velocity<Expression>(model_, x, wheel);
    const auto f = drive_body::wheel_force<Expression>(model_, u, wheel);
    const double F = model_.force() / model_.stall_force;
    const double unit = 1.0 / model_.max_speed;
    const double softness = 1e-3 * model_.max_speed;
    const Expression square = v[0] * v[0] + v[1] * v[1];
    const Expression speed = sqrt(square + softness * softness);
    return ((f[0] * v[0] + f[1] * v[1]) * F - speed + square * (1.0 / model_.free_speed)) * unit;
  }

  const DriveProblem& problem_;
  const DriveModel& model_;
  const Layout& layout_;
  OptimalControlProblem& ocp_;
};

}  // namespace

void write_dynamics(const DriveProblem& problem, const Layout& layout, OptimalControlProblem& ocp) {
  Writer(problem, layout, ocp).dynamics();
}

void write_wheels(const DriveProblem& problem, const Layout& layout, OptimalControlProblem& ocp) {
  Writer(problem, layout, ocp).wheels();
}

}  // namespace flyball::drive_transcription
