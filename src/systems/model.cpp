#include <flyball/systems/model.hpp>

#include <cmath>

#include <flyball/systems/any_model.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

void complete(std::vector<Coordinate>& coordinates, Eigen::Index size, char letter) {
  coordinates.resize(static_cast<std::size_t>(size));
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    if (coordinates[i].name.empty()) {
      coordinates[i].name = detail::format("{}{}", letter, i + 1);
    }
  }
}

std::vector<double> values(const MatrixRef& v) {
  return {v.data(), v.data() + v.size()};
}

Refusal at_point(Refusal refused, const MatrixRef& x, const MatrixRef& u, double t) {
  return std::move(refused).with("t", t).with("x", values(x)).with("u", values(u));
}

Expected<void> check_finite_entries(const MatrixRef& v, const std::vector<Coordinate>& coordinates,
                                    std::string_view what, const MatrixRef& x, const MatrixRef& u,
                                    std::string_view where, double t) {
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    if (!std::isfinite(v(i, 0))) {
      const std::string& name = coordinates[static_cast<std::size_t>(i)].name;
      return at_point(refusal(ArgumentError::not_finite, where,
                              detail::format("the {} {} of the model", what, name))
                          .got(detail::format("{} at t = {} s",
                                              std::isnan(v(i, 0)) ? "nan" : format_number(v(i, 0)),
                                              format_number(t)))
                          .expected("finite"),
                      x, u, t);
    }
  }
  return {};
}

}  // namespace

namespace detail {

ModelDescription completed(ModelDescription description, Eigen::Index states, Eigen::Index inputs,
                           Eigen::Index outputs, bool has_output, const MatrixRef& parameters) {
  complete(description.states, states, 'x');
  complete(description.inputs, inputs, 'u');
  if (!has_output) {
    description.outputs = description.states;
  }
  complete(description.outputs, outputs, 'y');
  description.parameters.resize(static_cast<std::size_t>(parameters.size()));
  for (std::size_t i = 0; i < description.parameters.size(); ++i) {
    Parameter& parameter = description.parameters[i];
    parameter.value = parameters(static_cast<Eigen::Index>(i), 0);
    if (parameter.name.empty()) {
      parameter.name = format("p{}", i + 1);
    }
  }
  return description;
}

Expected<void> check_point(const ModelDescription& description, const MatrixRef& x,
                           const MatrixRef& u, std::string_view where, double t) {
  return Checks(where)
      .shape(x, static_cast<Eigen::Index>(description.states.size()), 1, "x", "states x 1")
      .shape(u, static_cast<Eigen::Index>(description.inputs.size()), 1, "u", "inputs x 1")
      .also([&] { return check_finite_entries(x, description.states, "state", x, u, where, t); })
      .also([&] { return check_finite_entries(u, description.inputs, "input", x, u, where, t); });
}

Expected<void> check_answer(std::string_view what, const std::vector<Coordinate>& coordinates,
                            const MatrixRef& answer, const MatrixRef& x, const MatrixRef& u,
                            std::string_view where, double t) {
  const auto size = static_cast<Eigen::Index>(coordinates.size());
  if (answer.rows() != size || answer.cols() != 1) {
    return at_point(
        refusal(ArgumentError::wrong_shape, where, format("the {} of the model", what))
            .got(format("{}x{} at t = {} s", answer.rows(), answer.cols(), format_number(t)))
            .expected(format("{} ({}x1)",
                             what == "derivative" ? "of the size of the state"
                                                  : "of as many entries as outputs()",
                             size)),
        x, u, t);
  }
  return check_finite_entries(answer, coordinates, format("{} of", what), x, u, where, t);
}

}  // namespace detail

void ModelFunctions::step(VectorOut x, const VectorIn& u, const VectorIn& p, double dt,
                          VectorOut work) const noexcept {
  const Eigen::Index n = x.size();
  auto at = work.head(n);
  auto slope = work.segment(n, n);
  auto sum = work.tail(n);
  // x + dt/6 (k1 + 2 k2 + 2 k3 + k4)
  derivative(x, u, p, slope);
  sum = slope;
  for (const double part : {0.5, 0.5, 1.0}) {
    at = x + part * dt * slope;
    derivative(at, u, p, slope);
    sum += (part == 1.0 ? 1.0 : 2.0) * slope;
  }
  x += dt / 6.0 * sum;
}

Expected<void> ModelFunctions::check(const VectorIn& x, const VectorIn& u, const VectorIn& p,
                                     std::string_view where, double t) const {
  FLYBALL_CHECK(detail::check_point(description_, x, u, where, t));
  Eigen::VectorXd dxdt(x.size());
  derivative(x, u, p, dxdt);
  FLYBALL_CHECK(detail::check_answer("derivative", description_.states, dxdt, x, u, where, t));
  Eigen::VectorXd y(static_cast<Eigen::Index>(description_.outputs.size()));
  output(x, u, p, y);
  return detail::check_answer("output", description_.outputs, y, x, u, where, t);
}

namespace {

/// A x + B u and its Jacobians without products into temporaries.
class LinearModel final : public ModelFunctions {
 public:
  explicit LinearModel(ContinuousSystem<> system)
      : ModelFunctions(describe(system)), system_(std::move(system)) {}

  void derivative(const VectorIn& x, const VectorIn& u, const VectorIn&,
                  VectorOut dxdt) const noexcept override {
    dxdt.noalias() = system_.A * x;
    dxdt.noalias() += system_.B * u;
  }
  void output(const VectorIn& x, const VectorIn& u, const VectorIn&,
              VectorOut y) const noexcept override {
    y.noalias() = system_.C * x;
    y.noalias() += system_.D * u;
  }
  void jacobians(const VectorIn&, const VectorIn&, const VectorIn&, MatrixOut A,
                 MatrixOut B) const noexcept override {
    A = system_.A;
    B = system_.B;
  }
  void output_jacobians(const VectorIn&, const VectorIn&, const VectorIn&, MatrixOut C,
                        MatrixOut D) const noexcept override {
    C = system_.C;
    D = system_.D;
  }
  void parameter_jacobians(const VectorIn&, const VectorIn&, const VectorIn&, MatrixOut,
                           MatrixOut) const noexcept override {}

 private:
  ContinuousSystem<> system_;
};

}  // namespace

AnyModel::AnyModel(std::shared_ptr<const ModelFunctions> functions)
    : functions_(std::move(functions)) {
  const ModelDescription& description = functions_->description();
  states_ = static_cast<Eigen::Index>(description.states.size());
  inputs_ = static_cast<Eigen::Index>(description.inputs.size());
  outputs_ = static_cast<Eigen::Index>(description.outputs.size());
  p_.resize(static_cast<Eigen::Index>(description.parameters.size()));
  for (Eigen::Index i = 0; i < p_.size(); ++i) {
    p_(i) = description.parameters[static_cast<std::size_t>(i)].value;
  }
}

std::shared_ptr<const ModelFunctions> AnyModel::linear(ContinuousSystem<> system) {
  return std::make_shared<const LinearModel>(std::move(system));
}

ModelDescription AnyModel::description() const {
  ModelDescription description = functions_->description();
  for (std::size_t i = 0; i < description.parameters.size(); ++i) {
    description.parameters[i].value = p_(static_cast<Eigen::Index>(i));
  }
  return description;
}

Expected<AnyModel> AnyModel::with_parameters(const MatrixRef& p) const {
  FLYBALL_CHECK(
      Checks("with_parameters").shape(p, p_.size(), 1, "p", "parameters x 1").finite(p, "p"));
  AnyModel model = *this;
  model.p_ = p;
  return model;
}

Expected<AnyModel> AnyModel::with_parameter(std::string_view name, double value) const {
  constexpr std::string_view where = "with_parameter";
  FLYBALL_CHECK(check_finite(value, where, name));
  std::vector<std::string_view> known;
  for (const Parameter& parameter : functions_->description().parameters) {
    if (parameter.name == name) {
      AnyModel model = *this;
      model.p_(static_cast<Eigen::Index>(known.size())) = value;
      return model;
    }
    known.push_back(parameter.name);
  }
  return refusal(ArgumentError::unknown_name, where, "the parameter")
      .got(detail::format("\"{}\"", name))
      .expected(known.empty() ? "none: the model has no parameters"
                              : detail::format("one of {}", detail::comma_separated("{}", known)));
}

}  // namespace flyball
