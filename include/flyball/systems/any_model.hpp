#pragma once

#include <memory>

#include <flyball/core/argument.hpp>
#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/math/integration/fixed_step.hpp>
#include <flyball/systems/model.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

/// A vector that is read, and one and a matrix that are written: contiguous memory of the caller.
using VectorIn = Eigen::Ref<const Eigen::VectorXd>;
using VectorOut = Eigen::Ref<Eigen::VectorXd>;
using MatrixOut = Eigen::Ref<Eigen::MatrixXd>;

/// What stands behind an AnyModel; derive from it to make a model that is not compiled, such as one
/// from formulas. All functions are for models whose sizes are those of the constructor, write into
/// memory of the right size, do not allocate where they are called once a period, and depend on
/// nothing but their arguments.
class ModelFunctions {
 public:
  virtual ~ModelFunctions() = default;

  /// dx/dt = f(x, u; p). @param p  In the order of the description's parameters.
  virtual void derivative(const VectorIn& x, const VectorIn& u, const VectorIn& p,
                          VectorOut dxdt) const noexcept = 0;
  /// y = h(x, u; p).
  virtual void output(const VectorIn& x, const VectorIn& u, const VectorIn& p,
                      VectorOut y) const noexcept = 0;
  /// A = ∂f/∂x (n x n), B = ∂f/∂u (n x m), exact.
  virtual void jacobians(const VectorIn& x, const VectorIn& u, const VectorIn& p, MatrixOut A,
                         MatrixOut B) const noexcept = 0;
  /// C = ∂h/∂x (p x n), D = ∂h/∂u (p x m), exact.
  virtual void output_jacobians(const VectorIn& x, const VectorIn& u, const VectorIn& p,
                                MatrixOut C, MatrixOut D) const noexcept = 0;
  /// ∂f/∂p (n x parameters) and ∂h/∂p (outputs x parameters), exact.
  virtual void parameter_jacobians(const VectorIn& x, const VectorIn& u, const VectorIn& p,
                                   MatrixOut F, MatrixOut H) const noexcept = 0;
  /// One step of the classical Runge-Kutta method, the input held: `x` becomes the state `dt`
  /// seconds later. Made of `derivative`; a compiled model does it in one call.
  /// @param work  3 n x 1, whatever is in it.
  virtual void step(VectorOut x, const VectorIn& u, const VectorIn& p, double dt,
                    VectorOut work) const noexcept;
  /// `check_model` of the thing itself, for parameters that are not its own: that its answers have
  /// the sizes of the description and are finite.
  [[nodiscard]] virtual Expected<void> check(const VectorIn& x, const VectorIn& u,
                                             const VectorIn& p, std::string_view where,
                                             double t) const;

  [[nodiscard]] const ModelDescription& description() const noexcept { return description_; }

 protected:
  /// @param description  Complete, as `describe` gives it: its lists have the model's sizes.
  explicit ModelFunctions(ModelDescription description) : description_(std::move(description)) {}
  ModelFunctions(const ModelFunctions&) = default;
  ModelFunctions& operator=(const ModelFunctions&) = default;

 private:
  ModelDescription description_;
};

namespace detail {

/// A compiled model behind ModelFunctions; its derivatives are those of dual numbers.
template <class M>
class CompiledModel;

}  // namespace detail

/// A model of any kind: what compiled code and run-time models (formulas, files) have in common.
/// It is a model itself. A value: copies share what computes and never change it; the values of
/// the parameters are each copy's own.
///
/// Any model converts to it, so that a function of an AnyModel takes all of them.
/// Cost: a call costs one indirection more than the model's own; what writes into the caller's
/// memory does not allocate for models that are sized at compile time, and for linear ones.
class AnyModel {
 public:
  /// A compiled model, written over a generic scalar.
  template <Model M>
    requires(!std::same_as<std::remove_cvref_t<M>, AnyModel>)
  // NOLINTNEXTLINE(google-explicit-constructor): every model is one of these.
  AnyModel(const M& model)
      : AnyModel(std::make_shared<const detail::CompiledModel<std::remove_cvref_t<M>>>(model)) {}
  /// A linear system: its derivatives are its matrices.
  /// @param system  Of shapes that fit (`check_system`).
  template <int States, int Inputs, int Outputs>
  // NOLINTNEXTLINE(google-explicit-constructor): every model is one of these.
  AnyModel(const ContinuousSystem<States, Inputs, Outputs>& system)
      : AnyModel(linear(ContinuousSystem<>{system.A, system.B, system.C, system.D})) {}
  /// What computes, made elsewhere: the hook for models that are not compiled.
  explicit AnyModel(std::shared_ptr<const ModelFunctions> functions);

  [[nodiscard]] Eigen::Index states() const noexcept { return states_; }
  [[nodiscard]] Eigen::Index inputs() const noexcept { return inputs_; }
  [[nodiscard]] Eigen::Index outputs() const noexcept { return outputs_; }
  /// With the names, the units and this copy's values of the parameters. Allocates.
  [[nodiscard]] ModelDescription description() const;
  /// The same without the values of the parameters, which are those that it was made with.
  [[nodiscard]] const ModelDescription& names() const noexcept { return functions_->description(); }

  /// The parameters' values, in the order of the description.
  [[nodiscard]] const Eigen::VectorXd& parameters() const noexcept { return p_; }
  /// The same model with other values. @errors ArgumentError::wrong_shape, not_finite.
  [[nodiscard]] Expected<AnyModel> with_parameters(const MatrixRef& p) const;
  /// The same with one other value. @errors ArgumentError::unknown_name with the names, not_finite.
  [[nodiscard]] Expected<AnyModel> with_parameter(std::string_view name, double value) const;

  /// dx/dt = f(x, u), into `dxdt` (n x 1). @param x  n x 1. @param u  m x 1.
  void derivative(const VectorIn& x, const VectorIn& u, VectorOut dxdt) const noexcept {
    functions_->derivative(x, u, p_, dxdt);
  }
  /// y = h(x, u), into `y` (p x 1).
  void output(const VectorIn& x, const VectorIn& u, VectorOut y) const noexcept {
    functions_->output(x, u, p_, y);
  }
  /// A = ∂f/∂x (n x n) and B = ∂f/∂u (n x m), exact.
  void jacobians(const VectorIn& x, const VectorIn& u, MatrixOut A, MatrixOut B) const noexcept {
    functions_->jacobians(x, u, p_, A, B);
  }
  /// C = ∂h/∂x (p x n) and D = ∂h/∂u (p x m), exact.
  void output_jacobians(const VectorIn& x, const VectorIn& u, MatrixOut C,
                        MatrixOut D) const noexcept {
    functions_->output_jacobians(x, u, p_, C, D);
  }
  /// F = ∂f/∂p (n x parameters) and H = ∂h/∂p (outputs x parameters), exact.
  void parameter_jacobians(const VectorIn& x, const VectorIn& u, MatrixOut F,
                           MatrixOut H) const noexcept {
    functions_->parameter_jacobians(x, u, p_, F, H);
  }

  /// The same as a new vector, for code that is written for every model. Allocates.
  ///@{
  [[nodiscard]] Eigen::VectorXd derivative(const VectorIn& x, const VectorIn& u) const {
    Eigen::VectorXd dxdt(states_);
    derivative(x, u, dxdt);
    return dxdt;
  }
  [[nodiscard]] Eigen::VectorXd output(const VectorIn& x, const VectorIn& u) const {
    Eigen::VectorXd y(outputs_);
    output(x, u, y);
    return y;
  }
  ///@}

  /// One step of the classical Runge-Kutta method: `x` (n x 1) becomes the state `dt` seconds
  /// later, the input held. @param work  3 n x 1, whatever is in it. `ModelStepper` holds one.
  void step(VectorOut x, const VectorIn& u, double dt, VectorOut work) const noexcept {
    functions_->step(x, u, p_, dt, work);
  }

  /// As `check_model`, which calls this.
  [[nodiscard]] Expected<void> check(const VectorIn& x, const VectorIn& u, std::string_view where,
                                     double t = 0.0) const {
    return functions_->check(x, u, p_, where, t);
  }

 private:
  [[nodiscard]] static std::shared_ptr<const ModelFunctions> linear(ContinuousSystem<> system);

  std::shared_ptr<const ModelFunctions> functions_;
  Eigen::VectorXd p_;
  Eigen::Index states_;
  Eigen::Index inputs_;
  Eigen::Index outputs_;
};

namespace detail {

template <class M>
class CompiledModel final : public ModelFunctions {
 public:
  explicit CompiledModel(const M& model) : ModelFunctions(describe(model)), model_(model) {}

  void derivative(const VectorIn& x, const VectorIn& u, const VectorIn& p,
                  VectorOut dxdt) const noexcept override {
    assign(dxdt, f(state(x), input(u), parameters(p)));
  }
  void output(const VectorIn& x, const VectorIn& u, const VectorIn& p,
              VectorOut y) const noexcept override {
    assign(y, h(state(x), input(u), parameters(p)));
  }
  void jacobians(const VectorIn& x, const VectorIn& u, const VectorIn& p, MatrixOut A,
                 MatrixOut B) const noexcept override {
    if constexpr (requires { model_.jacobians(x, u, p, A, B); }) {
      model_.jacobians(x, u, p, A, B);
    } else if constexpr (!ParametricModel<M> && requires { model_.jacobians(x, u, A, B); }) {
      model_.jacobians(x, u, A, B);
    } else {
      const auto of_f = flyball::jacobians(
          [&](const auto& at, const auto& in) { return f(at, in, parameters(p)); }, state(x),
          input(u));
      assign(A, of_f.by_x);
      assign(B, of_f.by_u);
    }
  }
  void output_jacobians(const VectorIn& x, const VectorIn& u, const VectorIn& p, MatrixOut C,
                        MatrixOut D) const noexcept override {
    if constexpr (requires { model_.output_jacobians(x, u, p, C, D); }) {
      model_.output_jacobians(x, u, p, C, D);
    } else if constexpr (!ParametricModel<M> && requires { model_.output_jacobians(x, u, C, D); }) {
      model_.output_jacobians(x, u, C, D);
    } else {
      const auto of_h = flyball::jacobians(
          [&](const auto& at, const auto& in) { return h(at, in, parameters(p)); }, state(x),
          input(u));
      assign(C, of_h.by_x);
      assign(D, of_h.by_u);
    }
  }
  void parameter_jacobians(const VectorIn& x, const VectorIn& u, const VectorIn& p, MatrixOut F,
                           MatrixOut H) const noexcept override {
    if constexpr (ParametricModel<M>) {
      assign(F, jacobian([&](const auto& q) { return f(state(x), input(u), q); }, parameters(p)));
      if constexpr (requires { model_.output(x, u, model_.parameters()); }) {
        assign(H, jacobian([&](const auto& q) { return h(state(x), input(u), q); }, parameters(p)));
        return;
      }
    }
    H.setZero();
  }
  void step(VectorOut x, const VectorIn& u, const VectorIn& p, double dt,
            VectorOut work) const noexcept override {
    using State = StateOf<M>;
    using Derivative = decltype(f(state(x), input(u), parameters(p)));
    if constexpr (int(State::SizeAtCompileTime) != Eigen::Dynamic &&
                  int(State::SizeAtCompileTime) == int(Derivative::SizeAtCompileTime)) {
      const auto in = input(u);
      const auto own = parameters(p);
      x = rk4([&](const State& at) { return State(f(at, in, own)); }, State(x), dt);
    } else {
      ModelFunctions::step(x, u, p, dt, work);
    }
  }
  [[nodiscard]] Expected<void> check(const VectorIn& x, const VectorIn& u, const VectorIn& p,
                                     std::string_view where, double t) const override {
    return Checks(where)
        .also([&] { return check_point(description(), x, u, where, t); })
        .also([&] {
          const Eigen::MatrixXd dxdt = f(state(x), input(u), parameters(p));
          return check_answer("derivative", description().states, dxdt, x, u, where, t);
        })
        .also([&] {
          const Eigen::MatrixXd y = h(state(x), input(u), parameters(p));
          return check_answer("output", description().outputs, y, x, u, where, t);
        });
  }

 private:
  // Small vectors of fixed size are copied, so that formulas see their sizes; others are passed on.
  template <int Size>
  [[nodiscard]] static decltype(auto) sized(const VectorIn& v) {
    if constexpr (Size == Eigen::Dynamic) {
      return (v);
    } else {
      return Eigen::Matrix<double, Size, 1>(v);
    }
  }
  [[nodiscard]] static decltype(auto) state(const VectorIn& x) {
    return sized<fixed_states<M>()>(x);
  }
  [[nodiscard]] static decltype(auto) input(const VectorIn& u) {
    return sized<fixed_inputs<M>()>(u);
  }
  [[nodiscard]] static decltype(auto) parameters(const VectorIn& p) {
    if constexpr (ParametricModel<M>) {
      using Own = std::remove_cvref_t<decltype(std::declval<const M&>().parameters())>;
      return sized<Own::RowsAtCompileTime>(p);
    } else {
      return (p);
    }
  }

  template <class X, class U, class P>
  [[nodiscard]] auto f(const X& x, const U& u, const P& p) const {
    if constexpr (ParametricModel<M>) {
      return model_.derivative(x, u, p).eval();
    } else {
      return model_.derivative(x, u).eval();
    }
  }
  template <class X, class U, class P>
  [[nodiscard]] auto h(const X& x, const U& u, const P& p) const {
    return output_of(model_, x, u, p);
  }

  // A model that breaks its promise of a size gives NaN, which every check refuses, and no memory
  // beyond its own is read.
  template <class Target, class Value>
  static void assign(Target& target, const Value& value) noexcept {
    if (target.rows() == value.rows() && target.cols() == value.cols()) {
      target = value;
    } else {
      target.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }

  M model_;
};

}  // namespace detail

}  // namespace flyball
