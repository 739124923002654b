// A loop's answer for programs.
#include <cmath>
#include <limits>
#include <numbers>

#include <flyball/io/json_writer.hpp>

#include "study/answer/loop_study_parts.hpp"

namespace flyball::study {

namespace {

double gain_in_decibels(double gain) {
  return 20.0 * std::log10(gain);
}

void write_margins(JsonWriter& json, const LoopFindings& loop) {
  const classical::LoopMargins& m = *loop.margins;
  json.object("margins", [&] {
    json.add("stable", m.stable);
    if (m.unstable_poles == std::numeric_limits<int>::max()) {
      json.add("unstable_poles", std::numeric_limits<double>::infinity());
    } else {
      json.add("unstable_poles", m.unstable_poles);
    }
    json.add("gain_margin", m.gain_margin);
    json.add("phase_margin_deg", m.phase_margin);
    json.add({{"delay_margin", m.delay_margin}, {"disk_margin", m.disk_margin}});
    json.add("sensitivity_peak", {{"Ms", m.sensitivity.value}, {"w", m.sensitivity.frequency}});
    json.add("bandwidth", loop.bandwidth);
    json.list("phase_margins", m.gain_crossings, [&](const classical::GainCrossing& at) {
      json.object([&] { json.add({{"w", at.frequency}, {"pm_deg", at.phase_margin}}); });
    });
    json.list("gain_margins", m.phase_crossings, [&](const classical::PhaseCrossing& at) {
      json.object([&] { json.add({{"w", at.frequency}, {"gm", at.gain_margin}}); });
    });
  });
}

void write_locus(JsonWriter& json, const LoopFindings& loop) {
  const classical::RootLocus& locus = *loop.locus;
  json.object("root_locus", [&] {
    json.add("gains", locus.gains);
    json.key("branches");
    json.open('[');
    for (Eigen::Index branch = 0; branch < locus.branches.cols(); ++branch) {
      json.write(Eigen::VectorXcd(locus.branches.col(branch)));
    }
    json.close(']');
    json.list("branch_points", locus.branch_points, [&](const classical::BranchPoint& at) {
      json.object([&] {
        json.add("point", std::vector{at.point.real(), at.point.imag()});
        json.add("gain", at.gain);
        json.add("branches", at.branches);
      });
    });
    json.list("crossings", locus.crossings, [&](const classical::BorderCrossing& at) {
      json.object([&] {
        json.add("point", std::vector{at.point.real(), at.point.imag()});
        json.add({{"w", at.frequency}, {"gain", at.gain}});
      });
    });
    json.object("asymptotes", [&] {
      json.add("center", locus.asymptotes.center);
      json.add("angles_deg", locus.asymptotes.angles);
    });
    for (const auto& [name, angles] :
         {std::pair("departures", &locus.departures), std::pair("arrivals", &locus.arrivals)}) {
      json.list(name, *angles, [&](const classical::LocusAngles& root) {
        json.object([&] {
          json.add("root", std::vector{root.root.real(), root.root.imag()});
          json.add("angles_deg", root.angles);
        });
      });
    }
    json.list("stable_gains", locus.stable_gains, [&](const classical::GainRange& range) {
      json.object([&] { json.add({{"low", range.low}, {"high", range.high}}); });
    });
    json.list("at_damping", loop.at_damping, [&](const classical::LocusPoint& at) {
      json.object([&] {
        json.add("point", std::vector{at.point.real(), at.point.imag()});
        json.add("gain", at.gain);
      });
    });
  });
}

void write_pid(JsonWriter& json, const PidLoop& pid) {
  json.object("pid", [&] {
    json.add({{"kp", pid.gains.kp},
              {"ki", pid.gains.ki},
              {"kd", pid.gains.kd},
              {"derivative_time_constant", pid.derivative_time_constant}});
    json.add("num", pid.controller.num());
    json.add("den", pid.controller.den());
  });
}

void write_response(JsonWriter& json, std::string_view name, const LoopResponse& response) {
  json.object(name, [&] {
    json.add("time", response.time);
    json.add("value", response.value);
    if (response.metrics) {
      const classical::StepMetrics& m = *response.metrics;
      json.object("step", [&] {
        json.add("final_value", m.final_value);
        json.add("rise_time", m.rise_time);
        json.add("settling_time", m.settling_time);
        json.add("overshoot", m.overshoot ? std::optional(100.0 * *m.overshoot) : m.overshoot);
        json.add("undershoot", m.undershoot ? std::optional(100.0 * *m.undershoot) : m.undershoot);
        json.add("peak", m.peak);
        json.add("peak_time", m.peak_time);
      });
    }
  });
}

}  // namespace

std::string to_json(const LoopResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", loop_schema);
    json.add("view", to_string(result.job.view));
    if (result.frequency.size() > 0) {
      json.add("w", result.frequency);
    }
    json.list("loops", result.loops, [&](const LoopFindings& loop) {
      json.object([&] {
        json.add("expression", loop.name);
        if (const classical::TransferFunction* transfer = loop.rational()) {
          json.add("num", transfer->num());
          json.add("den", transfer->den());
          json.add("delay", transfer->delay());
        } else {
          json.add("delays", loop.delays());
        }
        if (loop.period()) {
          json.add("dt", loop.period()->si());
        }
        json.add("zeros", loop.zeros);
        json.add("poles", loop.poles);
        json.add("dcgain", loop.dc_gain());
        if (loop.margins) {
          write_margins(json, loop);
        }
        if (loop.bode) {
          std::vector<double> gains;
          for (const double gain : loop.bode->gain) {
            gains.push_back(gain_in_decibels(gain));
          }
          json.add("gain_db", gains);
          json.add("phase_deg", loop.bode->phase);
        }
        if (loop.nyquist) {
          json.object("nyquist", [&] {
            json.add("w", loop.nyquist->frequency);
            json.add("value", loop.nyquist->value);
            json.add("encirclements", loop.nyquist->encirclements);
            json.add("open_loop_unstable", loop.nyquist->open_loop_unstable);
            json.add("closed_loop_unstable", loop.nyquist->closed_loop_unstable);
            json.add("distance", loop.nyquist->distance);
          });
        }
        if (loop.locus) {
          write_locus(json, loop);
        }
        if (loop.closed_poles) {
          json.add("closed_loop_poles", *loop.closed_poles);
        }
        if (loop.pid) {
          write_pid(json, *loop.pid);
        }
        if (loop.response) {
          write_response(json, "response", *loop.response);
        }
        if (loop.load) {
          write_response(json, "load", *loop.load);
        }
      });
    });
    json.add("diagnostics", result.diagnostics);
  });
  return std::move(json).text();
}

}  // namespace flyball::study
