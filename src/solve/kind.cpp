#include <flyball/solve/kind.hpp>

#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/text.hpp>

#include "core/try.hpp"
#include "solve/configurations.hpp"
#include "solve/paths.hpp"
#include "solve/row.hpp"

namespace flyball::solve {

std::vector<Field> operator+(std::vector<Field> some, const std::vector<Field>& more) {
  some.insert(some.end(), more.begin(), more.end());
  return some;
}

std::vector<Field> answered_system(std::string_view states, std::string_view inputs,
                                   std::string_view outputs) {
  return {matrix("A", states, states, "how the states move by themselves"),
          matrix("B", states, inputs, "how the inputs move the states"),
          matrix("C", outputs, states, "how the outputs see the states"),
          matrix("D", outputs, inputs, "how the inputs reach the outputs")};
}

Outcome check_size(double numbers, std::string_view where, std::string_view about) {
  constexpr double most = 5e6;
  if (numbers <= most) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, where, about)
      .got(fmt::format("so large that {:.3g} numbers are answered", numbers))
      .expected(fmt::format("such that at most {:.0f} are", most));
}

std::span<const Kind> kinds() {
  static const std::vector<Kind> all = [] {
    std::vector<Kind> table;
    const auto add = [&](std::string_view section, std::vector<Kind> rows) {
      for (Kind& kind : rows) {
        kind.section = section;
        table.push_back(std::move(kind));
      }
    };
    add("Matrix equations and functions", matrix_equation_kinds());
    add("Systems", system_kinds());
    add("Responses", response_kinds());
    add("Transfer functions", transfer_function_kinds());
    add("Transfer functions", transfer_algebra_kinds());
    add("Root loci", root_locus_kinds());
    add("Step responses", step_kinds());
    add("Frequency responses and margins", frequency_response_kinds());
    add("Realizations", realization_kinds());
    add("Interconnections", interconnection_kinds());
    add("Interconnections", diagram_kinds());
    add("Regulators", regulator_kinds());
    add("Predictive control", predictive_control_kinds());
    add("Feedforward and delay", feedforward_kinds());
    add("Followers", follower_kinds());
    add("Certificates", certificate_kinds());
    add("PID", pid_kinds());
    add("Compensators and robust synthesis", compensator_kinds());
    add("Observers", estimator_kinds());
    add("Regression", regression_kinds());
    add("Spectra and frequency responses", spectrum_kinds());
    add("Filters and signals", filter_kinds());
    add("Models from records", identification_kinds());
    add("Configuration spaces", configuration_kinds());
    add("Paths", path_kinds());
    return table;
  }();
  return all;
}

Expected<const Kind*> find_kind(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Kind& kind : kinds()) {
    if (kind.name == name) {
      return &kind;
    }
    names.push_back(kind.name);
  }
  const std::string nearest = nearest_name(name, names);
  return refusal(ArgumentError::unknown_name, "solve", "kind of problem")
      .got("\"" + std::string(name) + "\"")
      .expected(fmt::format("one of {}", fmt::join(names, ", ")))
      .hint(nearest.empty() ? "" : "did you mean \"" + nearest + "\"?");
}

}  // namespace flyball::solve
