#include <limits>

#include <flyball/core/argument.hpp>

#include "core/constants.hpp"
#include "core/wording.hpp"
#include "study/estimate_project.hpp"
#include "study/named_values.hpp"

namespace flyball::study {

namespace {

class EstimateReader : private NamedValues {
 public:
  EstimateReader(TomlDocument& document, const Project& project, const AnyModel& model)
      : NamedValues(document, project, model.names().states, model.names().inputs),
        outputs_(model.names().outputs),
        said_(project.estimate) {}

  ModelEstimate estimate(const Eigen::VectorXd& x) {
    using enum OutlierTreatment;
    ModelEstimate made{.is_unscented = said_.filter == "unscented",
                       .smoother = said_.smoother.value_or(true),
                       .tune = said_.tune,
                       .process_noise = Eigen::VectorXd::Zero(x.size()),
                       .measurement_noise = of_outputs(),
                       .initial = x,
                       .initial_std = Eigen::VectorXd::Ones(x.size()),
                       .lower = Eigen::VectorXd::Constant(x.size(), -infinity),
                       .upper = Eigen::VectorXd::Constant(x.size(), infinity)};
    if (!said_.outliers.empty() && said_.outliers != "none") {
      made.outliers = said_.outliers == "gate" ? gate : said_.outliers == "huber" ? huber : student;
    }
    const auto read = [&](const char* section, const NamedTexts& said, Range range,
                          Eigen::VectorXd& values) {
      read_values(section, said, range, &values, nullptr);
    };
    read("estimate.process_noise", said_.process_noise, Range::not_negative, made.process_noise);
    read("estimate.initial", said_.initial, Range::any, made.initial);
    read("estimate.initial_std", said_.initial_std, Range::not_negative, made.initial_std);
    read("estimate.lower_limit", said_.lower_limit, Range::any, made.lower);
    read("estimate.upper_limit", said_.upper_limit, Range::any, made.upper);
    check_limits(made);
    return made;
  }

 private:
  /// The key under which a state's limit stands that something is wrong with.
  void refuse_limit(const char* key, const Coordinate& state, double got, std::string_view expected,
                    std::string_view hint) {
    const auto with_unit = [&](double value) {
      return text::number(value, 6) + (state.unit.empty() ? "" : " " + state.unit);
    };
    document_.refuse(std::string("estimate.") + key, state.name,
                     Error(ArgumentError::out_of_range)
                         .got(with_unit(got))
                         .expected(std::string(expected))
                         .hint(std::string(hint)));
  }

  void check_limits(const ModelEstimate& made) {
    for (std::size_t i = 0; i < states_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const double lower = made.lower(k);
      const double upper = made.upper(k);
      if (!(lower < upper)) {
        refuse_limit("upper_limit", states_[i], upper, "above lower_limit",
                     "exchange the two, or fix the state in the model");
      } else if (made.initial(k) < lower || made.initial(k) > upper) {
        refuse_limit(made.initial(k) < lower ? "lower_limit" : "upper_limit", states_[i],
                     made.initial(k) < lower ? lower : upper, "a limit that the start keeps",
                     "say where the state starts: [estimate] initial");
      }
    }
  }

  Eigen::VectorXd of_outputs() {
    constexpr const char* section = "estimate.measurement_noise";
    Eigen::VectorXd values = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(outputs_.size()),
                                                       std::numeric_limits<double>::quiet_NaN());
    for (const NamedText& one : said_.measurement_noise) {
      const std::size_t output = place_of(outputs_, one.name);
      if (output == outputs_.size()) {
        document_.refuse(section, one.name, unknown(one.name, {&outputs_}, "an output"),
                         TomlDocument::Fault::key);
      } else if (const auto si = value(section, one, outputs_[output].unit, Range::positive)) {
        values(static_cast<Eigen::Index>(output)) = *si;
      }
    }
    return values;
  }

  const std::vector<Coordinate>& outputs_;
  const EstimateSection& said_;
};

}  // namespace

ModelEstimate model_estimate(TomlDocument& document, const Project& project, const AnyModel& model,
                             const Eigen::VectorXd& x) {
  return EstimateReader(document, project, model).estimate(x);
}

}  // namespace flyball::study
