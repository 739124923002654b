// What may be said of a loop, row by row, and a command line as a job.
#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include <flyball/classical/transfer_expression.hpp>
#include <flyball/io/file.hpp>
#include <flyball/study/loop_study.hpp>

#include "core/try.hpp"
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
constexpr unsigned every = 0xFF;
constexpr unsigned in_frequency = views(bode, nyquist, nichols, sisotool);
constexpr unsigned in_time = views(step, impulse, sisotool);

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
};

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
            in_time}};

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
  static constexpr std::array<std::string_view, 8> names{"bode", "nyquist", "nichols", "rlocus",
                                                         "step", "impulse", "margins", "sisotool"};
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
  for (const std::string& expression : expressions) {
    if (expression.ends_with(".json")) {
      FLYBALL_TRY(std::string read, expression_of(expression, job));
      job.expressions.push_back(std::move(read));
    } else {
      job.expressions.push_back(expression);
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
