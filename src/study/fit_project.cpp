#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <flyball/core/text.hpp>
#include <flyball/core/unit_algebra.hpp>

#include "core/constants.hpp"
#include "study/fit_project.hpp"
#include "study/named_values.hpp"

namespace flyball::study {

namespace {

std::string trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(' ');
  return first == std::string_view::npos
             ? std::string()
             : std::string(text.substr(first, text.find_last_not_of(' ') - first + 1));
}

/// "0" of "0 .. 5 cm" is in cm, too.
std::string with_unit_of(const std::string& text, const std::string& other) {
  const auto own = split_quantity(text, "");
  const auto given = split_quantity(other, "");
  return own && given && own->unit.empty() ? fmt::format("{} {}", text, given->unit) : text;
}

class FitReader : private NamedValues {
 public:
  FitReader(TomlDocument& document, const Project& project, const AnyModel& model)
      : NamedValues(document, project, model.names().states, model.names().inputs),
        model_(model),
        said_(project.fit) {}

  ModelFit fit(const Eigen::VectorXd& x) {
    ModelFit made;
    for (const NamedText& one : said_.free) {
      read_free(one, made.free);
    }
    made.channels = channels("fit.channels", said_.channels);
    if (!said_.validation_channels.empty()) {
      made.validation_channels = channels("fit.validation_channels", said_.validation_channels);
    }
    Eigen::VectorXd initial = x;
    read_values("fit.initial", said_.initial, Range::any, &initial, nullptr);
    for (const double value : initial) {
      made.initial.push_back({.value = value});
    }
    for (const std::string& name : said_.free_initial) {
      if (const std::size_t place = place_of(states_, name); place < states_.size()) {
        made.initial[place].is_free = true;
      } else {
        document_.refuse("fit", "free_initial", unknown(name, {&states_}, "a state"));
      }
    }
    identification::PredictionErrorOptions& options = made.options;
    options.hold = said_.hold == "linear"  ? identification::InputHold::linear
                   : said_.hold == "cubic" ? identification::InputHold::cubic
                                           : identification::InputHold::held;
    using enum optimization::Loss;
    for (const optimization::Loss loss : {squared, soft_l1, huber, cauchy, tukey}) {
      if (said_.loss == to_string(loss)) {
        options.loss.kind = loss;
      }
    }
    // Cauchy's and Tukey's scales of 95 % efficiency for normal errors.
    options.loss.scale = options.loss.kind == tukey    ? 4.685
                         : options.loss.kind == cauchy ? 2.385
                                                       : 1.5;
    options.starts = said_.starts.value_or(1);
    options.seed = said_.seed;
    options.profile = said_.profile;
    return made;
  }

 private:
  void read_free(const NamedText& said, std::vector<identification::FreeParameter>& free) {
    const std::vector<Parameter>& known = model_.names().parameters;
    const auto found = std::find_if(known.begin(), known.end(), [&](const Parameter& parameter) {
      return parameter.name == said.name;
    });
    if (found == known.end()) {
      std::vector<Coordinate> names;
      for (const Parameter& parameter : known) {
        names.push_back({.name = parameter.name});
      }
      document_.refuse("fit.free", said.name,
                       unknown(said.name, {&names}, "a parameter of the model"),
                       TomlDocument::Fault::key);
      return;
    }
    const auto number = [&](const std::string& text) {
      return value("fit.free", {said.name, text}, found->unit, Range::any);
    };
    identification::FreeParameter made{.name = said.name};
    const std::string text = trimmed(said.text);
    const auto after = [&](std::string_view sign) { return trimmed(text.substr(sign.size())); };
    const std::size_t dots = text.find("..");
    const std::size_t around = text.find("±");
    if (dots != std::string::npos) {
      const std::string high = trimmed(text.substr(dots + 2));
      const std::string low = with_unit_of(trimmed(text.substr(0, dots)), high);
      made.lower = number(low).value_or(-infinity);
      made.upper = number(high).value_or(infinity);
    } else if (around != std::string::npos) {
      const std::string std = trimmed(text.substr(around + std::string_view("±").size()));
      const std::string mean = with_unit_of(trimmed(text.substr(0, around)), std);
      made.mean = number(mean).value_or(0.0);
      made.std = number(std).value_or(infinity);
    } else if (text.starts_with(">=")) {
      made.lower = number(after(">=")).value_or(-infinity);
    } else if (text.starts_with("<=")) {
      made.upper = number(after("<=")).value_or(infinity);
    } else if (text != "free") {
      refuse_range(said, "not a range", "\"free\", \"0 .. 5\", \">= 0\", \"<= 5\" or \"5 ± 1\"");
    }
    if (!(made.lower <= made.upper)) {
      refuse_range(said, "upside down", "from the smaller to the larger value");
    } else if (!(made.std > 0.0)) {
      refuse_range(said, "without a width", "a value ± a positive one");
    }
    free.push_back(std::move(made));
  }

  void refuse_range(const NamedText& said, std::string_view got, std::string_view expected) {
    document_.refuse("fit.free", said.name,
                     Error(ArgumentError::malformed)
                         .about(document_.name("fit.free", said.name))
                         .got(fmt::format("\"{}\", {}", said.text, got))
                         .expected(std::string(expected)));
  }

  /// Of inputs and outputs: the one that is said, or its own name.
  std::vector<std::string> channels(const std::string& section, const NamedTexts& said) {
    const std::vector<Coordinate>& outputs = model_.names().outputs;
    std::vector<std::string> made;
    for (const std::vector<Coordinate>* list :
         std::initializer_list<const std::vector<Coordinate>*>{&inputs_, &outputs}) {
      for (const Coordinate& one : *list) {
        const auto found = std::find_if(
            said.begin(), said.end(), [&](const NamedText& text) { return text.name == one.name; });
        made.push_back(found == said.end() ? one.name : found->text);
      }
    }
    for (const NamedText& one : said) {
      if (place_of(inputs_, one.name) == inputs_.size() &&
          place_of(outputs, one.name) == outputs.size()) {
        document_.refuse(section, one.name,
                         unknown(one.name, {&inputs_, &outputs}, "an input or an output"),
                         TomlDocument::Fault::key);
      }
    }
    return made;
  }

  const AnyModel& model_;
  const FitSection& said_;
};

}  // namespace

ModelFit model_fit(TomlDocument& document, const Project& project, const AnyModel& model,
                   const Eigen::VectorXd& x) {
  return FitReader(document, project, model).fit(x);
}

}  // namespace flyball::study
