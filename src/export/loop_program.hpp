#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <flyball/control/mechanism_controller.hpp>

/// A mechanism's loop as data, from which each language's source is written: its constants and its
/// arithmetic, in the order in which MechanismController computes. Expressions are sums and
/// products of indexed names, which C++, Java and Python write the same way.
namespace flyball::exports {

/// A number, a vector of n or a matrix of n x n.
struct LoopConstant {
  enum class Shape { number, vector, matrix };
  std::string name;
  Shape shape;
  Eigen::MatrixXd value;
  std::string comment;  ///< Unit first.
};

struct LoopProgram {
  mechanisms::MechanismKind kind{};
  mechanisms::FeedforwardGains gains{};
  Eigen::Index states = 1;
  std::string unit{};                      ///< Of the position.
  std::vector<std::string> state_names{};  ///< "position (m)", …
  std::string measured{};                  ///< "position" or "velocity".
  std::string measured_unit{};
  bool moves_measurement = false;  ///< A measurement is late, and is moved to now.
  std::size_t on_the_way = 0;  ///< Inputs that the state is predicted with; 0 for no prediction.
  bool gravity = false;        ///< Gravity is fed forward, of an arm with its cosine.
  bool friction = false;
  bool compensates = false;  ///< The battery's voltage is compensated and limits the answer.

  std::vector<LoopConstant> constants{};

  /// With the names of `constants`, measurement, r, r_next, x_hat_, u_model_, x, demand and error;
  /// with prediction delayed_, arriving_, newer and older:
  std::string rate{};                     ///< dr/dt.
  std::string speed{};                    ///< The index of the velocity in a reference, "[1]".
  std::vector<std::string> prediction{};  ///< x of x_hat_ and u_model_, or delayed_ and arriving_.
  std::vector<std::string> one_period{};  ///< x_hat_ one period on, of newer and older.
  std::vector<std::string> rest{};        ///< x_hat_ over the rest of the delay, of newer.
  std::vector<std::string> demand{};      ///< Of r and r_next.
  std::vector<std::string> error{};       ///< Of r and x_hat_.
  std::string inversion{};                ///< Of demand.
  std::string feedback{};                 ///< Of error.

  [[nodiscard]] bool flywheel() const { return controls_velocity(kind); }
  [[nodiscard]] bool arm() const { return kind == mechanisms::MechanismKind::arm; }
  [[nodiscard]] double period() const { return constants.front().value(0, 0); }
};

/// @errors Those of MechanismController::create.
[[nodiscard]] Expected<LoopProgram> loop_program(const MechanismControllerDesign& design,
                                                 std::string_view unit);

}  // namespace flyball::exports
