#pragma once

#include <Eigen/Core>

#include <flyball/core/function_ref.hpp>
#include <flyball/systems/model_step.hpp>

namespace flyball {

/// What a simulated loop is closed around: something with a state that moves on while its inputs
/// are held, however it does so (a model that is integrated, a mechanism that has an exact step).
/// The description's lists have the plant's sizes, which do not change while it lives.
class SimulatedPlant {
 public:
  virtual ~SimulatedPlant() = default;

  /// Names, units and which coordinates are angles.
  [[nodiscard]] virtual const ModelDescription& description() const noexcept = 0;
  /// n x 1, now.
  [[nodiscard]] virtual const Eigen::VectorXd& state() const noexcept = 0;
  /// p x 1, now, into `y`. @param u  m x 1, the inputs that act now.
  virtual void output(const VectorIn& u, VectorOut y) = 0;
  /// Moves on. @param time  s, now, for messages. @param u  m x 1, held. @param duration  s, >= 0.
  /// @errors What ends the simulation, such as a state that is not finite.
  [[nodiscard]] virtual Expected<void> advance(double time, const VectorIn& u, double duration) = 0;

 protected:
  SimulatedPlant() = default;
  SimulatedPlant(const SimulatedPlant&) = default;
  SimulatedPlant(SimulatedPlant&&) = default;
  SimulatedPlant& operator=(const SimulatedPlant&) = default;
  SimulatedPlant& operator=(SimulatedPlant&&) = default;
};

/// How a model is integrated between the changes of its inputs.
struct ModelIntegration {
  /// s, the longest step of the classical Runge-Kutta method.
  Time max_step{1e-3};
  /// Relative accuracy of each step, of the states' magnitude or one; 0 takes the steps above, else
  /// the steps are as long as the accuracy allows, and stiff models are integrated as such.
  double accuracy = 0.0;
};

/// An error of `integrate` about a model, in the model's words: which derivative is no number
/// where the integration ends, or which state changes faster than steps can follow, and when.
/// @param input  u at a time. @param where  The function's name.
[[nodiscard]] Error explained(Error error, const AnyModel& model,
                              FunctionRef<Eigen::VectorXd(double)> input, std::string_view where);

/// A plant that is any model, integrated.
class ModelPlant final : public SimulatedPlant {
 public:
  /// @param x0  n x 1, where it starts.
  /// @errors Those of `check_model` at x0 without input: a derivative or an output that is NaN or
  /// of
  ///         another size is refused here; ArgumentError for the integration's numbers.
  [[nodiscard]] static Expected<ModelPlant> create(const AnyModel& model, const MatrixRef& x0,
                                                   const ModelIntegration& integration = {});

  [[nodiscard]] const ModelDescription& description() const noexcept override {
    return stepper_.model().names();
  }
  [[nodiscard]] const Eigen::VectorXd& state() const noexcept override { return x_; }
  void output(const VectorIn& u, VectorOut y) override { stepper_.model().output(x_, u, y); }
  /// @errors ArgumentError::not_finite naming the state, or its derivative, and the time;
  ///         IntegrationError where an accuracy is asked for.
  [[nodiscard]] Expected<void> advance(double time, const VectorIn& u, double duration) override;

 private:
  ModelPlant(const AnyModel& model, const MatrixRef& x0, const ModelIntegration& integration);

  [[nodiscard]] Expected<void> not_finite(double time, const VectorIn& u) const;

  ModelStepper stepper_;
  ModelIntegration integration_;
  Eigen::VectorXd x_;
  Eigen::VectorXd before_{};  ///< The state before the last step.
};

}  // namespace flyball
