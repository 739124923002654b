// What may be said of a loop, row by row, and a command line as a job.
#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include <flyball/classical/transfer_expression.hpp>
#include <flyball/io/file.hpp>
#include <flyball/study/loop_study.hpp>

#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/field.hpp"
#include "study/toml_document.hpp"

namespace flyball::study {

namespace {

using enum Dimension;
using enum Range;
using enum LoopView;

constexpr unsigned bit(LoopView view) {
  return 1U << static_cast<unsigned>(view);
}
template <class... Views>
constexpr unsigned views(Views... some) {
  return (bit(some) | ...);
}
constexpr unsigned every = 0x1FF;
constexpr unsigned in_frequency = views(bode, nyquist, nichols, sisotool, pidtune);
constexpr unsigned in_time = views(step, impulse, sisotool, pidtune);
constexpr unsigned tuning = views(pidtune);

/// A row, and whose it is.
struct LoopRow {
  Field field;
  unsigned views = every;
};

/// What stands for G in place of an expression.
struct Typed {
  LoopJob job{};
  std::string num{};
  std::string den{};
  std::string form = "pid";
  std::string method{};
};

Expected<void> known_word(const std::string& text, std::string_view words) {
  const std::vector<std::string_view> all = text::split(words, ", ");
  if (std::find(all.begin(), all.end(), text) != all.end()) {
    return {};
  }
  const std::string nearest = nearest_name(text, all);
  return refusal(ArgumentError::unknown_name)
      .got("\"" + text + "\"")
      .expected("one of " + std::string(words))
      .hint(nearest.empty() ? "" : "did you mean \"" + nearest + "\"?");
}

constexpr std::string_view forms = "pid, pi, pd, p";
constexpr std::string_view methods = "robust, loop-shape, simc, poles";

const std::array rows{
    LoopRow{text("num", at<&Typed::num>(), "\"1 2\"",
                 "In place of EXPR the numerator's coefficients, the highest power first")
                .takes("LIST")
                .without("EXPR")},
    LoopRow{text("den", at<&Typed::den>(), "\"1 3 2\"", "and the denominator's")
                .takes("LIST")
                .without("EXPR")},
    LoopRow{text("compensator", at<&Typed::job, &LoopJob::compensator>(), "\"2*(1 + 0.1s)\"",
                 "What stands in series before each EXPR, for example a PD controller")
                .takes("EXPR")
                .without("1")},
    LoopRow{quantity("gain", at<&Typed::job, &LoopJob::gain>(), dimensionless, not_zero, "2.5",
                     "A factor k of the loop")
                .takes("NUMBER")
                .without("1")},
    LoopRow{quantity("period", at<&Typed::job, &LoopJob::period>(), time, positive, "\"20 ms\"",
                     "The sample period of z")
                .without("needed with z")},
    LoopRow{quantity("delay", at<&Typed::job, &LoopJob::delay>(), time, not_negative, "\"0.1 s\"",
                     "Dead time of the loop beside that of EXPR")
                .without("0 s"),
            every & ~bit(rlocus)},
    LoopRow{flag("closed", at<&Typed::job, &LoopJob::closed>(), "true",
                 "Respond as the closed loop kCG/(1 + kCG)")
                .without("false"),
            views(step, impulse)},
    LoopRow{flag("negative", at<&Typed::job, &LoopJob::negative>(), "true",
                 "Follow negative gains, k from 0 to -∞")
                .without("false"),
            views(rlocus, sisotool)},
    LoopRow{quantity("damping", at<&Typed::job, &LoopJob::damping>(), dimensionless, not_negative,
                     "0.7", "Tell the gains at which a pole has this damping ratio")
                .takes("RATIO")
                .without("none"),
            views(rlocus, sisotool)},
    LoopRow{quantity("from", at<&Typed::job, &LoopJob::from>(), angular_velocity, positive,
                     "\"0.1 rad/s\"", "The lowest frequency")
                .takes("FREQUENCY")
                .without("chosen"),
            in_frequency},
    LoopRow{quantity("to", at<&Typed::job, &LoopJob::to>(), angular_velocity, positive,
                     "\"100 rad/s\"", "The highest frequency")
                .takes("FREQUENCY")
                .without("chosen"),
            in_frequency},
    LoopRow{quantity("duration", at<&Typed::job, &LoopJob::duration>(), time, positive, "\"5 s\"",
                     "How long the response is followed")
                .without("until it has settled"),
            in_time},
    LoopRow{text("form", at<&Typed::form>(), "pi", "The terms that the controller has")
                .one_of(forms)
                .checked([](const std::string& text) { return known_word(text, forms); })
                .without("pid"),
            tuning},
    LoopRow{text("method", at<&Typed::method>(), "simc",
                 "What decides: the most integral gain for a robustness, crossover and phase "
                 "margin, Skogestad's rules, or a dominant pair of poles")
                .one_of(methods)
                .checked([](const std::string& text) { return known_word(text, methods); })
                .without("robust; loop-shape with --crossover, poles with --natural-frequency"),
            tuning},
    LoopRow{quantity("ms", at<&Typed::job, &LoopJob::pid, &PidGoal::sensitivity>(), dimensionless,
                     positive, "1.4", "Of robust, the largest |1/(1 + L)|: 1.2 is calm, 2 lively")
                .takes("NUMBER")
                .without("1.4"),
            tuning},
    LoopRow{quantity("mt", at<&Typed::job, &LoopJob::pid, &PidGoal::complementary>(), dimensionless,
                     positive, "1.3", "Of robust, the largest |L/(1 + L)|")
                .takes("NUMBER")
                .without("any"),
            tuning},
    LoopRow{quantity("crossover", at<&Typed::job, &LoopJob::pid, &PidGoal::crossover>(),
                     angular_velocity, positive, "\"2 rad/s\"", "Of loop-shape, where |L| is 1")
                .takes("FREQUENCY")
                .without("needed with loop-shape"),
            tuning},
    LoopRow{quantity("phase_margin", at<&Typed::job, &LoopJob::pid, &PidGoal::phase_margin>(),
                     dimensionless, positive, "60", "Of loop-shape, there, in degrees")
                .takes("DEGREES")
                .without("60"),
            tuning},
    LoopRow{
        quantity("closed_loop_time", at<&Typed::job, &LoopJob::pid, &PidGoal::closed_loop_time>(),
                 time, not_negative, "\"0.5 s\"", "Of simc, the time constant that it aims at")
            .without("the dead time"),
        tuning},
    LoopRow{
        quantity("natural_frequency", at<&Typed::job, &LoopJob::pid, &PidGoal::natural_frequency>(),
                 angular_velocity, positive, "\"2 rad/s\"",
                 "Of poles, that of the dominant pair; PID has a real pole as far away, too")
            .takes("FREQUENCY")
            .without("needed with poles"),
        tuning},
    LoopRow{quantity("damping_ratio", at<&Typed::job, &LoopJob::pid, &PidGoal::damping_ratio>(),
                     dimensionless, positive, "0.7", "Of poles, that of the pair, below 1")
                .takes("RATIO")
                .without("0.7"),
            tuning},
    LoopRow{quantity("filter_ratio", at<&Typed::job, &LoopJob::pid, &PidGoal::filter_ratio>(),
                     dimensionless, positive, "10", "The derivative's time over that of its filter")
                .takes("NUMBER")
                .without("10"),
            tuning}};

/// The words of a form and a method, and which of the others' options do not go with it.
Expected<void> settle_pid(const Typed& typed, PidGoal& goal) {
  goal.form = typed.form == "p"    ? PidForm::p
              : typed.form == "pi" ? PidForm::pi
              : typed.form == "pd" ? PidForm::pd
                                   : PidForm::pid;
  std::string method = typed.method;
  if (method.empty()) {
    method = goal.crossover ? "loop-shape" : goal.natural_frequency ? "poles" : "robust";
  }
  goal.method = method == "loop-shape" ? PidMethod::loop_shape
                : method == "simc"     ? PidMethod::simc
                : method == "poles"    ? PidMethod::poles
                                       : PidMethod::robust;
  struct Owned {
    const char* option;
    const char* method;
    bool given;
  };
  for (const Owned& one :
       {Owned{"--crossover", "loop-shape", goal.crossover.has_value()},
        Owned{"--natural-frequency", "poles", goal.natural_frequency.has_value()}}) {
    if (one.given != (method == one.method)) {
      return refusal(ArgumentError::malformed, "pidtune", one.option)
          .got(one.given ? "given" : "left out")
          .expected(one.given ? "left out with --method " + method
                              : std::string("given with --method ") + one.method + ", such as " +
                                    one.option + " 2rad/s");
    }
  }
  return {};
}

constexpr std::string_view section_name = "loop";

std::vector<Field> fields_of_view(LoopView view) {
  std::vector<Field> fields;
  for (const LoopRow& row : rows) {
    if ((row.views & bit(view)) != 0U) {
      fields.push_back(row.field);
    }
  }
  return fields;
}

std::string example_of(const Field& field) {
  std::string example(field.example);
  std::erase(example, '"');
  const bool plain = example.find_first_of(" *()") == std::string::npos;
  return plain ? example : "'" + example + "'";
}

/// [1 2]/[1 3 2] of what a file says in lists.
Expected<std::string> expression_of(const std::string& path, LoopJob& job) {
  FLYBALL_TRY(const std::string content, read_file(path, 1U << 20U));
  const auto json = nlohmann::json::parse(content, nullptr, false);
  const auto refuse = [&](std::string what, std::string got, std::string expected) {
    return refusal(ArgumentError::malformed, path, std::move(what))
        .got(std::move(got))
        .expected(std::move(expected));
  };
  if (!json.is_object()) {
    return refuse("the file", json.is_discarded() ? "no JSON" : "no object",
                  R"(an object such as {"num": [2], "den": [1, 3, 2], "delay": 0.1})");
  }
  for (const auto& [key, unused] : json.items()) {
    if (key != "num" && key != "den" && key != "expr" && key != "dt" && key != "delay") {
      return refusal(ArgumentError::unknown_name, path, "\"" + key + "\"")
          .got("not known")
          .expected("expr, or num and den; and dt, delay");
    }
  }
  const auto number = [&](const char* key) -> Expected<double> {
    if (!json.contains(key)) {
      return 0.0;
    }
    if (!json[key].is_number()) {
      return refuse(key, "no number", "a number of seconds");
    }
    return json[key].get<double>();
  };
  FLYBALL_TRY(const double dt, number("dt"));
  FLYBALL_TRY(const double delay, number("delay"));
  FLYBALL_CHECK(Checks(path).not_negative(dt, "dt", "s").not_negative(delay, "delay", "s"));
  if (dt > 0.0 && !job.period) {
    job.period = Time(dt);
  }
  job.delay = Time(job.delay.si() + delay);
  if (json.contains("expr") && json["expr"].is_string()) {
    return json["expr"].get<std::string>();
  }
  std::string expression;
  for (const char* key : {"num", "den"}) {
    if (!json.contains(key) || !json[key].is_array() || json[key].empty()) {
      return refuse(key, json.contains(key) ? "no list of numbers" : "left out",
                    "a list of coefficients, the highest power first");
    }
    expression += expression.empty() ? "[" : "/[";
    for (const auto& value : json[key]) {
      if (!value.is_number()) {
        return refuse(key, "no list of numbers", "a list of coefficients");
      }
      expression += value.dump() + " ";
    }
    expression.back() = ']';
  }
  return expression;
}

}  // namespace

std::string_view to_string(LoopView view) {
  static constexpr std::array<std::string_view, 9> names{
      "bode", "nyquist", "nichols", "rlocus", "step", "impulse", "margins", "sisotool", "pidtune"};
  return names[static_cast<std::size_t>(view)];
}

std::vector<FieldInfo> loop_fields(LoopView view) {
  std::vector<FieldInfo> all;
  for (const Field& field : fields_of_view(view)) {
    const std::string value = !field.metavar.empty()              ? std::string(field.metavar)
                              : field.type == FieldType::flag     ? ""
                              : field.dimension.dimension == time ? "TIME"
                                                                  : "VALUE";
    all.push_back({.section = std::string(section_name),
                   .key = std::string(field.key),
                   .option = option_of(field),
                   .value = value,
                   .help = std::string(field.help),
                   .example = example_of(field),
                   .absent = std::string(field.absent)});
  }
  return all;
}

ExpectedAll<LoopJob> loop_job(LoopView view, const std::vector<std::string>& expressions,
                              std::span<const Override> given) {
  const std::vector<Field> fields = fields_of_view(view);
  const std::array sections{Section{section_name, fields,
                                    [](void* document, bool) { return document; },
                                    "What is asked of a loop."}};
  const Document table{sections, [](const void*) -> std::optional<SignalDimensions> { return {}; }};
  TomlDocument document("", "");
  document.apply(given, sections);
  Typed typed;
  typed.job.view = view;
  document.read(table, &typed);
  if (auto errors = document.errors()) {
    return tl::unexpected(*std::move(errors));
  }
  LoopJob job = std::move(typed.job);
  if (view == pidtune) {
    FLYBALL_CHECK(
        settle_pid(typed, job.pid).map_error([](Error error) { return Errors(std::move(error)); }));
  }
  for (const std::string& expression : expressions) {
    if (expression.ends_with(".json")) {
      FLYBALL_TRY(std::string read, expression_of(expression, job));
      job.expressions.push_back(std::move(read));
    } else {
      const std::size_t first = expression.find_first_not_of(' ');
      job.expressions.push_back(expression.substr(std::min(first, expression.size())));
    }
  }
  if (!typed.num.empty() || !typed.den.empty()) {
    if (typed.num.empty() || typed.den.empty()) {
      return tl::unexpected(Error(ArgumentError::empty)
                                .in(std::string(to_string(view)))
                                .about(typed.num.empty() ? "--num" : "--den")
                                .got("left out")
                                .expected("given with the other"));
    }
    const auto list = [](const std::string& text) {
      return text.find('[') == std::string::npos ? "[" + text + "]" : text;
    };
    job.expressions.push_back(list(typed.num) + "/" + list(typed.den));
  }
  if (job.expressions.empty()) {
    return tl::unexpected(
        Error(ArgumentError::empty)
            .in(std::string(to_string(view)))
            .about("EXPR")
            .got("left out")
            .expected("a transfer function such as \"2/(s^2+3*s+2)*exp(-0.1*s)\", "
                      "or --num and --den"));
  }
  constexpr std::size_t most = 16;
  if (job.expressions.size() > most) {
    return tl::unexpected(Error(ArgumentError::out_of_range)
                              .in(std::string(to_string(view)))
                              .about("the transfer functions")
                              .got(std::to_string(job.expressions.size()))
                              .expected("at most 16: one picture shows no more"));
  }
  if (job.damping && *job.damping >= 1.0) {
    return tl::unexpected(Error(ArgumentError::out_of_range)
                              .about("--damping")
                              .got(format_number(*job.damping))
                              .expected("below 1: from there on poles are real"));
  }
  if (job.from && job.to && !(job.from->si() < job.to->si())) {
    return tl::unexpected(Error(ArgumentError::out_of_range)
                              .about("--from")
                              .got(format_number(job.from->si()) + " rad/s")
                              .expected("below --to"));
  }
  return job;
}

}  // namespace flyball::study
