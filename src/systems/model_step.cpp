#include <flyball/systems/model_step.hpp>

namespace flyball {

ModelStepper::ModelStepper(AnyModel model)
    : model_(std::move(model)),
      at_(model_.states()),
      slope_(model_.states()),
      sum_(model_.states()) {}

void ModelStepper::step(VectorOut x, const VectorIn& u, double dt) noexcept {
  // x + dt/6 (k1 + 2 k2 + 2 k3 + k4)
  model_.derivative(x, u, slope_);
  sum_ = slope_;
  for (const double part : {0.5, 0.5, 1.0}) {
    at_ = x + part * dt * slope_;
    model_.derivative(at_, u, slope_);
    sum_ += (part == 1.0 ? 1.0 : 2.0) * slope_;
  }
  x += dt / 6.0 * sum_;
}

}  // namespace flyball
