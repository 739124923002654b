#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/math/expression/formula.hpp>

#include "study/toml_document.hpp"

namespace flyball::study {

/// Reads what a file says by the names of states, inputs and outputs; every error goes to the
/// document.
class NamedValues {
 public:
  NamedValues(TomlDocument& document, const Project& project, std::vector<Coordinate> states = {},
              std::vector<Coordinate> inputs = {})
      : document_(document),
        project_(project),
        states_(std::move(states)),
        inputs_(std::move(inputs)) {}

  /// What [simulation] says. @param u  m, the inputs where no other is said. @param outputs  Those
  /// that are measured; null if they are not known. @param closed_loop  If it does not say so.
  ModelRun run(const Eigen::VectorXd& u, const std::vector<Coordinate>* outputs, bool closed_loop);

 protected:
  static std::size_t place_of(const std::vector<Coordinate>& list, const std::string& name);
  static Error unknown(const std::string& name,
                       std::initializer_list<const std::vector<Coordinate>*> lists,
                       std::string_view what);
  /// A value with the unit of a coordinate, in SI; nothing where it is refused.
  std::optional<double> value(const std::string& section, const NamedText& said,
                              const std::string& unit, Range range);
  /// Values by the names of states and inputs. @param x, u  Where they go; null: not allowed.
  void read_values(const std::string& section, const NamedTexts& said, Range range,
                   Eigen::VectorXd* x, Eigen::VectorXd* u);

  TomlDocument& document_;
  const Project& project_;
  std::vector<Coordinate> states_;
  std::vector<Coordinate> inputs_;
  std::vector<Parameter> parameters_;  ///< Their names may stand in an input's formula.

 private:
  std::vector<double> of_outputs(const std::string& section, const NamedTexts& said,
                                 const std::vector<Coordinate>* outputs);
  InputSignals read_input(const Eigen::VectorXd& u);
  std::optional<std::string> input_formula(const std::string& section, const NamedText& said,
                                           const std::string& unit, expression::FormulaSet set);
};

}  // namespace flyball::study
