#include <cmath>
#include <memory>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/io/file.hpp>
#include <flyball/io/plot.hpp>
#include <flyball/study/analyze.hpp>
#include <flyball/study/solve.hpp>

#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* schema = "flyball.analyze/1";

struct Options {
  CommonOptions common;
  std::string model;
};

std::string matrix_text(const Eigen::MatrixXd& M) {
  std::string text;
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    text += " ";
    for (Eigen::Index j = 0; j < M.cols(); ++j) {
      text += fmt::format(" {:>12.6g}", M(i, j));
    }
    text += '\n';
  }
  return text;
}

std::string counted(Eigen::Index count, std::string_view what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string to_text(const study::ModelAnalysis& analysis) {
  const study::ModelFile& model = analysis.model;
  const bool continuous = model.domain == TimeDomain::continuous;
  std::string text = fmt::format(
      "A {} system with {}, {} and {}{}: {}\n\nPoles\n{}\n", continuous ? "continuous" : "discrete",
      counted(model.system.A.rows(), "state"), counted(model.system.B.cols(), "input"),
      counted(model.system.C.rows(), "output"),
      continuous ? std::string() : fmt::format(", sampled each {:g} s", model.period.si()),
      to_string(analysis.modes.stability), describe(analysis.modes));
  text += fmt::format("\nControllability\n{}\n", describe(analysis.controllability, model.states));
  text += fmt::format("\nObservability\n{}\n", describe(analysis.observability, model.states));
  if (analysis.dc_gain) {
    text += fmt::format("\nGain at rest, outputs x inputs\n{}", matrix_text(*analysis.dc_gain));
  } else {
    text += "\nGain at rest: infinite, the system integrates\n";
  }
  if (analysis.h2_norm) {
    text += fmt::format("\nH2 norm {:.6g}", *analysis.h2_norm);
  }
  if (analysis.h_infinity_norm) {
    text += fmt::format("\nH-infinity norm {:.6g} at {:.6g} rad/s\n",
                        analysis.h_infinity_norm->norm, analysis.h_infinity_norm->frequency);
  }
  return text;
}

Plot pole_map(const study::ModelAnalysis& analysis) {
  PolePlotGroup group{.label = "open-loop"};
  for (const Mode& mode : analysis.modes.modes) {
    group.poles.push_back(mode.pole);
  }
  return pole_plot("Poles", {group}, analysis.model.domain == TimeDomain::discrete);
}

Plot step_plot(const study::ModelAnalysis& analysis) {
  Plot plot{.title = "Step responses", .x_label = "Time (s)"};
  for (Eigen::Index output = 0; output < analysis.model.system.C.rows(); ++output) {
    PlotPanel panel{.y_label = fmt::format("Output y{}", output + 1)};
    for (std::size_t input = 0; input < analysis.steps.size(); ++input) {
      const study::StepResponse& step = analysis.steps[input];
      PlotLine line{.label = fmt::format("after a unit step of u{}", input + 1)};
      line.x.assign(step.time.begin(), step.time.end());
      for (Eigen::Index k = 0; k < step.y.rows(); ++k) {
        line.y.push_back(step.y(k, output));
      }
      if (analysis.model.domain == TimeDomain::discrete) {
        line.style = LineStyle::steps;
      }
      panel.lines.push_back(std::move(line));
    }
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

std::string step_csv(const study::ModelAnalysis& analysis) {
  std::string text = "time (s)";
  for (std::size_t input = 0; input < analysis.steps.size(); ++input) {
    for (Eigen::Index output = 0; output < analysis.model.system.C.rows(); ++output) {
      text += fmt::format(",y{} after u{}", output + 1, input + 1);
    }
  }
  text += '\n';
  const Eigen::VectorXd& time = analysis.steps.front().time;
  for (Eigen::Index k = 0; k < time.size(); ++k) {
    text += fmt::format("{}", time(k));
    for (const study::StepResponse& step : analysis.steps) {
      for (Eigen::Index output = 0; output < step.y.cols(); ++output) {
        text += fmt::format(",{}", step.y(k, output));
      }
    }
    text += '\n';
  }
  return text;
}

/// Text, pictures and data in one folder, whole or not at all.
Expected<std::string> write_folder(const study::ModelAnalysis& analysis, const std::string& path) {
  auto folder = OutputFolder::create(path);
  if (!folder) {
    return tl::unexpected(folder.error());
  }
  const std::string at = folder->path() + "/";
  const Plot poles = pole_map(analysis);
  const Plot steps = step_plot(analysis);
  Expected<void> status = folder->write("analysis.txt", to_text(analysis));
  const auto then = [&status](auto&& write) {
    if (status) {
      status = write();
    }
  };
  then([&] { return folder->write("step_response.csv", step_csv(analysis)); });
  then([&] { return write_png(at + "poles.png", poles); });
  then([&] { return write_svg(at + "poles.svg", poles); });
  then([&] { return write_png(at + "step_response.png", steps); });
  then([&] { return write_svg(at + "step_response.svg", steps); });
  then([&] { return folder->commit(); });
  if (!status) {
    return tl::unexpected(status.error());
  }
  return folder->destination();
}

int run(const Options& options) {
  const auto text = read_file(options.model);
  if (!text) {
    return fail(text.error(), options.common, schema);
  }
  const auto model = study::parse_model(*text, options.model);
  if (!model) {
    return fail(model.error(), options.common, schema);
  }
  const auto analysis = study::analyze(*model);
  if (!analysis) {
    return fail(analysis.error(), options.common, schema);
  }
  std::string folder;
  if (!options.common.out.empty()) {
    const auto written = write_folder(*analysis, options.common.out);
    if (!written) {
      return fail(written.error(), options.common, schema);
    }
    folder = *written;
  }
  if (options.common.json) {
    nlohmann::ordered_json problem = nlohmann::ordered_json::parse(*text);
    problem.erase("states");
    problem["domain"] = model->domain == TimeDomain::continuous ? "continuous" : "discrete";
    const study::SolveAnswer answer = study::Solver::create("analyze")->solve(problem.dump());
    print("{\"schema\":\"" + std::string(schema) + "\"," + answer.json.substr(1));
    return success;
  }
  print(to_text(*analysis));
  if (!folder.empty()) {
    print("\nPictures and data: " + folder);
  }
  return success;
}

}  // namespace

void add_analyze_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "analyze", "Say what a linear system is like: poles, controllability, observability, gains");
  auto options = std::make_shared<Options>();
  command
      ->add_option("MODEL", options->model,
                   "A JSON file with A and B, and perhaps C, D, domain (\"continuous\" or "
                   "\"discrete\"), T (s) and states (names)")
      ->required();
  add_common_options(*command, options->common,
                     "Write a pole map and step responses, with their data, into this folder");
  command->callback([options, &invocation] { invocation.status = run(*options); });
}

}  // namespace flyball::app
