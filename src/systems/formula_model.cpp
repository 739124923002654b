#include <flyball/systems/formula_model.hpp>

#include <algorithm>
#include <array>
#include <utility>

#include <flyball/core/text.hpp>
#include <flyball/math/expression/differentiate.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using expression::CompiledFormulas;
using expression::Derivatives;
using expression::Formula;
using expression::FormulaSet;
using expression::Slot;
using expression::Tape;

/// Room for a tape's inputs, values and results: on the stack unless there are many.
class Room {
 public:
  explicit Room(std::size_t size) {
    if (size > small_.size()) {
      large_.resize(size);
    }
    data_ = large_.empty() ? small_.data() : large_.data();
  }
  Room(const Room&) = delete;
  Room& operator=(const Room&) = delete;

  std::span<double> take(std::size_t count) noexcept {
    return {std::exchange(data_, data_ + count), count};
  }

 private:
  std::array<double, 640> small_;  // NOLINT: not initialized, because all of it is written first
  std::vector<double> large_;
  double* data_ = nullptr;
};

/// A tape with what does not depend on its inputs computed for the parameters it was made with.
class PreparedTape {
 public:
  PreparedTape() = default;
  PreparedTape(Tape tape, const std::vector<double>& parameters)
      : tape_(std::move(tape)), parameters_(parameters), prepared_(tape_.size()) {
    tape_.prepare<double>(parameters_, prepared_);
    prepared_.resize(tape_.inputs() > 0 ? tape_.input_slot(0).index : tape_.size());
  }

  /// Calls `use` with room for the inputs, room for the results, and what computes these from
  /// those: as often as it is called, the parameters being looked at once.
  template <class Use>
  void open(const VectorIn& p, const Use& use) const noexcept {
    Room room(tape_.inputs() + tape_.size() + tape_.outputs());
    const std::span<double> in = room.take(tape_.inputs());
    const std::span<double> values = room.take(tape_.size());
    const std::span<double> out = room.take(tape_.outputs());
    if (std::equal(parameters_.begin(), parameters_.end(), p.data())) {
      std::copy(prepared_.begin(), prepared_.end(), values.begin());
    } else {
      tape_.prepare<double>({p.data(), static_cast<std::size_t>(p.size())}, values);
    }
    use(in, std::span<const double>(out), [&] { tape_.evaluate<double>(in, out, values); });
  }

  /// Calls `use` with the results. @param inputs  Each a part of the tape's inputs, in order.
  template <class Use>
  void evaluate(const VectorIn& x, const VectorIn& u, const VectorIn& p,
                const Use& use) const noexcept {
    open(p, [&](std::span<double> in, std::span<const double> out, const auto& compute) {
      std::copy_n(u.data(), u.size(), std::copy_n(x.data(), x.size(), in.data()));
      compute();
      use(out);
    });
  }

 private:
  Tape tape_;
  std::vector<double> parameters_;
  std::vector<double> prepared_;
};

/// A function with its Jacobian by a list of variables, of which parts are asked for.
class PreparedDerivatives {
 public:
  PreparedDerivatives(Derivatives derivatives, const std::vector<double>& parameters)
      : rows_(derivatives.rows),
        entries_(std::move(derivatives.entries)),
        tape_(std::move(derivatives.tape), parameters) {}

  /// @param first  The leading columns. @param second  The others.
  void evaluate(const VectorIn& x, const VectorIn& u, const VectorIn& p, MatrixOut& first,
                MatrixOut& second) const noexcept {
    first.setZero();
    second.setZero();
    tape_.evaluate(x, u, p, [&](std::span<const double> values) {
      for (std::size_t k = 0; k < entries_.size(); ++k) {
        const auto row = static_cast<Eigen::Index>(entries_[k].row);
        const auto column = static_cast<Eigen::Index>(entries_[k].column);
        (column < first.cols() ? first(row, column) : second(row, column - first.cols())) =
            values[rows_ + k];
      }
    });
  }

 private:
  std::size_t rows_;
  std::vector<expression::Entry> entries_;
  PreparedTape tape_;
};

std::vector<Slot> parameter_slots(const Tape& tape) {
  std::vector<Slot> slots;
  for (std::size_t k = 0; k < tape.parameters(); ++k) {
    slots.push_back(tape.parameter_slot(k));
  }
  return slots;
}

/// A function of states, inputs and parameters, with all its derivatives.
struct FunctionTapes {
  explicit FunctionTapes(const CompiledFormulas& made)
      : value(made.tape, made.parameters),
        by_inputs(differentiate(made.tape), made.parameters),
        by_parameters(differentiate(made.tape, parameter_slots(made.tape)), made.parameters) {}

  PreparedTape value;
  PreparedDerivatives by_inputs;
  PreparedDerivatives by_parameters;
};

class FormulaModel final : public ModelFunctions {
 public:
  FormulaModel(ModelDescription description, const CompiledFormulas& f, const CompiledFormulas& h)
      : ModelFunctions(std::move(description)), f_(f), h_(h) {}

  void derivative(const VectorIn& x, const VectorIn& u, const VectorIn& p,
                  VectorOut dxdt) const noexcept override {
    f_.value.evaluate(
        x, u, p, [&](std::span<const double> values) { std::ranges::copy(values, dxdt.data()); });
  }
  void output(const VectorIn& x, const VectorIn& u, const VectorIn& p,
              VectorOut y) const noexcept override {
    h_.value.evaluate(x, u, p,
                      [&](std::span<const double> values) { std::ranges::copy(values, y.data()); });
  }
  void jacobians(const VectorIn& x, const VectorIn& u, const VectorIn& p, MatrixOut A,
                 MatrixOut B) const noexcept override {
    f_.by_inputs.evaluate(x, u, p, A, B);
  }
  void output_jacobians(const VectorIn& x, const VectorIn& u, const VectorIn& p, MatrixOut C,
                        MatrixOut D) const noexcept override {
    h_.by_inputs.evaluate(x, u, p, C, D);
  }
  void parameter_jacobians(const VectorIn& x, const VectorIn& u, const VectorIn& p, MatrixOut F,
                           MatrixOut H) const noexcept override {
    Eigen::MatrixXd none(0, 0);
    MatrixOut rest(none);
    f_.by_parameters.evaluate(x, u, p, F, rest);
    h_.by_parameters.evaluate(x, u, p, H, rest);
  }
  void step(VectorOut x, const VectorIn& u, const VectorIn& p, double dt,
            VectorOut work) const noexcept override {
    f_.value.open(p, [&](std::span<double> in, std::span<const double> k, const auto& compute) {
      const auto n = static_cast<std::size_t>(x.size());
      double* const sum = work.data();
      const auto stage = [&](double weight, double ahead) {
        compute();
        for (std::size_t i = 0; i < n; ++i) {
          sum[i] += weight * k[i];
          in[i] = x.data()[i] + ahead * k[i];
        }
      };
      std::copy_n(u.data(), u.size(), std::copy_n(x.data(), x.size(), in.data()));
      std::fill_n(sum, n, 0.0);
      stage(1.0, 0.5 * dt);
      stage(2.0, 0.5 * dt);
      stage(2.0, dt);
      stage(1.0, 0.0);
      for (std::size_t i = 0; i < n; ++i) {
        x.data()[i] += dt / 6.0 * sum[i];
      }
    });
  }

 private:
  FunctionTapes f_;
  FunctionTapes h_;
};

/// The unit in SI: as it is written where that is SI already.
std::string si_text(const std::string& unit) {
  const auto parsed = unit.empty() ? Expected<SiUnit>() : parse_si_unit(unit);
  if (unit.empty() || !parsed) {
    return unit;
  }
  const std::string text = parsed->factor == 1.0 ? unit : to_text(parsed->dimension);
  return text == "1" ? "" : text;
}

std::vector<Coordinate> in_si(std::vector<Coordinate> coordinates) {
  for (Coordinate& coordinate : coordinates) {
    coordinate.unit = si_text(coordinate.unit);
  }
  return coordinates;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = std::min(text.find_first_not_of(" \t\r\n"), text.size());
  text.remove_prefix(first);
  return text.substr(0, text.find_last_not_of(" \t\r\n") + 1);
}

std::vector<std::string_view> names_of(const std::vector<Coordinate>& coordinates) {
  std::vector<std::string_view> names;
  for (const Coordinate& coordinate : coordinates) {
    names.push_back(coordinate.name);
  }
  return names;
}

/// The derivatives in the order of the states, and what is wrong with their names.
std::vector<Formula> ordered_derivatives(const ModelFormulas& model, std::vector<Error>& errors) {
  const std::vector<std::string_view> states = names_of(model.states);
  std::vector<Formula> ordered(states.size());
  for (const Formula& formula : model.derivatives) {
    const auto found = std::find(states.begin(), states.end(), formula.name);
    std::string where = "derivative of " + formula.name;
    if (found == states.end()) {
      const std::string nearest = nearest_name(formula.name, states);
      errors.push_back(
          refusal(ArgumentError::unknown_name, where, detail::format("\"{}\"", formula.name))
              .got("not a state")
              .hint(nearest.empty()
                        ? detail::format("states are {}", detail::comma_separated("{}", states))
                        : detail::format("did you mean \"{}\"?", nearest)));
      continue;
    }
    Formula& place = ordered[static_cast<std::size_t>(found - states.begin())];
    if (!place.name.empty()) {
      errors.push_back(refusal(ArgumentError::ambiguous_name, where,
                               detail::format("the derivative of \"{}\"", formula.name))
                           .got("given twice"));
      continue;
    }
    place = {std::move(where), formula.text, formula.unit};
  }
  for (std::size_t k = 0; k < states.size(); ++k) {
    const std::string& unit = model.states[k].unit;
    Formula& formula = ordered[k];
    if (formula.name.empty()) {
      errors.push_back(refusal(ArgumentError::empty, detail::format("derivative of {}", states[k]),
                               detail::format("the derivative of \"{}\"", states[k]))
                           .got("missing")
                           .hint(detail::format("each state needs one: {} = \"…\"", states[k])));
    } else if (formula.unit.empty() && !unit.empty()) {
      formula.unit = unit + "/s";
    }
  }
  std::erase_if(ordered, [](const Formula& formula) { return formula.name.empty(); });
  return ordered;
}

std::vector<Formula> named_outputs(const ModelFormulas& model, std::vector<Error>& errors) {
  std::vector<Formula> outputs;
  for (const Formula& formula : model.outputs) {
    std::string where = "output " + formula.name;
    if (std::any_of(outputs.begin(), outputs.end(),
                    [&](const Formula& other) { return other.name == where; })) {
      errors.push_back(refusal(ArgumentError::ambiguous_name, where,
                               detail::format("the output \"{}\"", formula.name))
                           .got("given twice"));
    }
    outputs.push_back({std::move(where), formula.text, formula.unit});
  }
  if (outputs.empty()) {
    for (const Coordinate& state : model.states) {
      outputs.push_back({"output " + state.name, state.name, state.unit});
    }
  }
  return outputs;
}

std::vector<Coordinate> output_coordinates(const ModelFormulas& model,
                                           const std::vector<Formula>& outputs,
                                           const CompiledFormulas& made) {
  std::vector<Coordinate> coordinates;
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    Coordinate coordinate{.name = outputs[k].name.substr(std::string_view("output ").size()),
                          .unit = outputs[k].unit};
    for (const Coordinate& state : model.states) {
      if (trimmed(outputs[k].text) == state.name) {
        coordinate.is_angle = state.is_angle;
        coordinate.unit = coordinate.unit.empty() ? state.unit : coordinate.unit;
      }
    }
    if (coordinate.unit.empty() && made.outputs[k]) {
      coordinate.unit = to_text(*made.outputs[k]);
    }
    coordinates.push_back(std::move(coordinate));
  }
  return in_si(std::move(coordinates));
}

/// Names, parameters and definitions, without outputs.
FormulaSet set_of(const ModelFormulas& formulas) {
  FormulaSet set;
  for (const std::vector<Coordinate>* list : {&formulas.states, &formulas.inputs}) {
    for (const Coordinate& coordinate : *list) {
      set.variables.push_back({coordinate.name, coordinate.unit});
    }
  }
  for (const Parameter& parameter : formulas.parameters) {
    set.parameters.push_back({parameter.name, parameter.unit, parameter.value});
  }
  set.definitions = formulas.definitions;
  return set;
}

}  // namespace

tl::expected<CompiledFormulas, std::vector<Error>> model_equations(
    const ModelFormulas& formulas, const std::vector<Formula>& further) {
  std::vector<Error> errors;
  FormulaSet set = set_of(formulas);
  set.outputs = ordered_derivatives(formulas, errors);
  if (!errors.empty()) {
    return tl::unexpected(std::move(errors));
  }
  set.outputs.insert(set.outputs.end(), further.begin(), further.end());
  return compile(set);
}

tl::expected<AnyModel, std::vector<Error>> formula_model(const ModelFormulas& formulas) {
  std::vector<Error> errors;
  if (formulas.states.empty()) {
    errors.push_back(Error(ArgumentError::empty)
                         .about("states")
                         .got("empty")
                         .expected("the name and the unit of at least one"));
  }
  const std::vector<Formula> derivatives = ordered_derivatives(formulas, errors);
  const std::vector<Formula> outputs = named_outputs(formulas, errors);
  FormulaSet set = set_of(formulas);
  // All at once for the errors, each being told once, then as two tapes.
  set.outputs = derivatives;
  set.outputs.insert(set.outputs.end(), outputs.begin(), outputs.end());
  if (auto all = compile(set); !all || !errors.empty()) {
    if (!all) {
      errors.insert(errors.end(), all.error().begin(), all.error().end());
    }
    return tl::unexpected(std::move(errors));
  }
  set.outputs = derivatives;
  const auto f = compile(set);
  set.outputs = outputs;
  const auto h = compile(set);
  if (!f || !h) {
    return tl::unexpected(f ? h.error() : f.error());
  }
  ModelDescription description{.name = formulas.name,
                               .states = in_si(formulas.states),
                               .inputs = in_si(formulas.inputs),
                               .outputs = output_coordinates(formulas, outputs, *h),
                               .parameters = formulas.parameters};
  for (std::size_t k = 0; k < description.parameters.size(); ++k) {
    Parameter& parameter = description.parameters[k];
    parameter.value = f->parameters[k];
    parameter.unit = si_text(parameter.unit);
  }
  return AnyModel(std::make_shared<const FormulaModel>(std::move(description), *f, *h));
}

}  // namespace flyball
