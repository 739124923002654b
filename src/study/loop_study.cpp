#include <flyball/study/loop_study.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/classical/delay_margins.hpp>
#include <flyball/classical/delay_poles.hpp>
#include <flyball/classical/delay_response.hpp>
#include <flyball/classical/transfer_expression.hpp>
#include <flyball/math/expression/formula.hpp>
#include <flyball/systems/response.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"

namespace flyball::study {

namespace {

using classical::DelaySystem;
using classical::TransferFunction;
using classical::TransferSystem;
using Eigen::Index;
using Eigen::VectorXd;
using enum LoopView;

/// An error of an expression with the line at fault, a caret under the place.
Errors quoted(Error error, std::span<const std::string> texts) {
  std::size_t which = 0;
  bool placed = false;
  for (const Evidence& evidence : error.evidence()) {
    if (evidence.name == "text" && !evidence.values.empty()) {
      which = static_cast<std::size_t>(evidence.values.front());
    }
    placed = placed || evidence.name == "offset";
  }
  if (!placed || which >= texts.size()) {
    return error;
  }
  QuotedError shown{std::move(error)};
  shown.excerpt = expression::caret_lines(texts[which], shown);
  return Errors(std::vector{std::move(shown)});
}

/// C and G.
std::vector<std::string> texts_of(const LoopJob& job, const std::string& expression) {
  return job.compensator.empty() ? std::vector{expression}
                                 : std::vector{job.compensator, expression};
}

/// k C G, with the dead time of the job.
ExpectedAll<TransferSystem> system_of(const LoopJob& job, const std::string& expression) {
  const std::vector<std::string> texts = texts_of(job, expression);
  auto parsed = classical::parse_transfer_system(
      texts, {.gain = job.gain, .period = job.period, .delay = job.delay});
  if (!parsed) {
    return tl::unexpected(quoted(std::move(parsed).error(), texts));
  }
  return *std::move(parsed);
}

Expected<DelaySystem> as_delay_system(const TransferSystem& system) {
  if (const auto* late = std::get_if<DelaySystem>(&system)) {
    return *late;
  }
  return DelaySystem::create(std::get<TransferFunction>(system));
}

std::vector<double> listed(const auto& values) {
  return {values.begin(), values.end()};
}

/// The response of one with dead time in its loops, or several of them.
Expected<LoopResponse> late_response(const DelaySystem& system, bool impulse,
                                     const std::optional<ResponseTimes>& times) {
  FLYBALL_TRY(const auto found, impulse ? classical::impulse_response(system, 0, times)
                                        : classical::step_response(system, 0, times));
  LoopResponse response{.time = listed(found.time), .value = listed(found.y.col(0)), .metrics = {}};
  if (!impulse) {
    FLYBALL_TRY(response.metrics, classical::step_metrics(system, 0, 0));
  }
  return response;
}

/// The response of a rational function behind its dead time.
Expected<LoopResponse> rational_response(const TransferFunction& transfer, bool impulse,
                                         const std::optional<ResponseTimes>& times) {
  const ContinuousSystem<> system = transfer.to_state_space();
  LinearResponse found;
  if (transfer.period()) {
    const DiscreteSystem<> sampled{system.A, system.B, system.C, system.D, *transfer.period()};
    FLYBALL_TRY(found,
                impulse ? impulse_response(sampled, 0, times) : step_response(sampled, 0, times));
  } else {
    FLYBALL_TRY(found,
                impulse ? impulse_response(system, 0, times) : step_response(system, 0, times));
  }
  LoopResponse response{.time = listed(found.time), .value = listed(found.y.col(0)), .metrics = {}};
  if (const double delay = transfer.delay(); delay > 0.0) {
    for (double& time : response.time) {
      time += delay;
    }
    response.time.insert(response.time.begin(), {0.0, delay});
    response.value.insert(response.value.begin(), {0.0, 0.0});
  }
  return response;
}

/// A gain: nothing moves.
LoopResponse static_response(const TransferFunction& transfer, double end) {
  const double gain = transfer.dc_gain();
  const double delay = transfer.delay();
  LoopResponse response;
  response.time = delay > 0.0 ? std::vector{0.0, delay, delay, delay + end} : std::vector{0.0, end};
  response.value = delay > 0.0 ? std::vector{0.0, 0.0, gain, gain} : std::vector{gain, gain};
  return response;
}

class Study {
 public:
  explicit Study(const LoopJob& job) : result_{.job = job} {}

  ExpectedAll<LoopResult> run() {
    for (const std::string& expression : job().expressions) {
      FLYBALL_TRY(auto system, system_of(job(), expression));
      result_.loops.push_back({.name = expression, .system = std::move(system)});
    }
    for (LoopFindings& loop : result_.loops) {
      if (auto found = look(loop); !found) {
        return tl::unexpected(named(loop, std::move(found).error()));
      }
    }
    if (in({bode, nichols, sisotool, margins, pidtune})) {
      FLYBALL_CHECK(bode_curves().map_error([](Error error) { return Errors(std::move(error)); }));
    }
    if (in({step, impulse, sisotool, pidtune})) {
      FLYBALL_CHECK(responses().map_error([](Error error) { return Errors(std::move(error)); }));
    }
    return std::move(result_);
  }

 private:
  [[nodiscard]] const LoopJob& job() const { return result_.job; }
  [[nodiscard]] bool in(std::initializer_list<LoopView> views) const {
    return std::find(views.begin(), views.end(), job().view) != views.end();
  }
  /// Which of several it is.
  [[nodiscard]] Error named(const LoopFindings& loop, Error error) const {
    return result_.loops.size() == 1 ? std::move(error)
                                     : Error(std::move(error).with("expression", loop.name));
  }

  [[nodiscard]] classical::FrequencyGridOptions grid_options() const {
    classical::FrequencyGridOptions options;
    if (job().from) {
      options.low = job().from->si();
    }
    if (job().to) {
      options.high = job().to->si();
    }
    return options;
  }

  /// What needs no common axis.
  Expected<void> look(LoopFindings& loop) {
    if (loop.rational() != nullptr) {
      FLYBALL_CHECK(look_at_roots(loop));
    } else {
      FLYBALL_TRY(const auto found, classical::rightmost_poles(std::get<DelaySystem>(loop.system)));
      loop.poles = found.poles;
    }
    if (job().view == pidtune) {
      return tune(loop);
    }
    if (in({bode, nyquist, nichols, margins, sisotool})) {
      FLYBALL_TRY(loop.margins, std::visit([](const auto& L) { return classical::loop_margins(L); },
                                           loop.system));
      FLYBALL_TRY(loop.bandwidth,
                  std::visit([](const auto& L) { return classical::bandwidth(L); }, loop.system));
    }
    if (in({nyquist, sisotool})) {
      FLYBALL_TRY(loop.nyquist, nyquist_of(loop));
    }
    if (in({rlocus, sisotool})) {
      FLYBALL_CHECK(locus(loop));
    }
    return {};
  }

  [[nodiscard]] Expected<classical::NyquistData> nyquist_of(const LoopFindings& loop) const {
    if (const TransferFunction* transfer = loop.rational()) {
      FLYBALL_TRY(const auto response, classical::frequency_response(*transfer));
      return classical::nyquist(response, grid_options());
    }
    return classical::nyquist(std::get<DelaySystem>(loop.system), grid_options());
  }

  /// Gains for the plant, and the loop with them in its place.
  Expected<void> tune(LoopFindings& loop) const {
    const TransferFunction* plant = loop.rational();
    if (plant == nullptr) {
      return tl::unexpected(several_dead_times());
    }
    const PidGoal& goal = job().pid;
    FLYBALL_TRY(auto tuned, tuned_for(*plant, goal));
    FLYBALL_TRY(auto open, classical::series(tuned.controller, *plant));
    loop.margins = tuned.margins;
    loop.pid = std::move(tuned);
    loop.plant = *plant;
    loop.system = std::move(open);
    return {};
  }

  static Expected<PidLoop> tuned_for(const TransferFunction& plant, const PidGoal& goal) {
    switch (goal.method) {
      case PidMethod::simc:
        return tune_simc(plant, goal.form, goal.closed_loop_time.si(), goal.filter_ratio);
      case PidMethod::loop_shape:
        return tune_by_loop_shape(plant, goal.form,
                                  {.crossover = goal.crossover ? goal.crossover->si() : 0.0,
                                   .phase_margin = goal.phase_margin,
                                   .filter_ratio = goal.filter_ratio});
      case PidMethod::poles:
        return tune_by_poles(
            plant, goal.form,
            {.natural_frequency = goal.natural_frequency ? goal.natural_frequency->si() : 0.0,
             .damping_ratio = goal.damping_ratio,
             .filter_ratio = goal.filter_ratio});
      case PidMethod::robust:
        break;
    }
    RobustnessGoal robust{.sensitivity = goal.sensitivity, .filter_ratio = goal.filter_ratio};
    robust.complementary = goal.complementary.value_or(robust.complementary);
    return tune_by_robustness(plant, goal.form, robust);
  }

  [[nodiscard]] Error several_dead_times() const {
    return refusal(classical::TransferError::delay_in_loop, to_string(job().view), "EXPR")
        .got("made of parts of several dead times")
        .expected("a rational function behind one dead time")
        .hint("bode, nyquist, nichols, margins and step take it as it is");
  }

  Expected<void> look_at_roots(LoopFindings& loop) {
    FLYBALL_TRY(const auto roots,
                classical::parse_zero_pole_gain(texts_of(job(), loop.name), job().period));
    loop.zeros = roots.zeros();
    loop.poles = roots.poles();
    FLYBALL_TRY(const auto left, classical::without_cancellations(roots));
    for (const classical::Cancellation& pair : left.cancelled) {
      if (pair.pole.imag() < 0.0) {
        continue;
      }
      const std::string pole = text::complex_number(pair.pole);
      if (pair.unstable) {
        warn(result_.diagnostics, "unstable_cancellation",
             "{}: a zero hides the pole at {}, which grows unseen: whatever the margins say, the "
             "loop is not stable",
             loop.name, pole);
      } else {
        note(result_.diagnostics, "cancellation",
             "{}: a zero hides the pole at {}; it stays where it is, whatever the gain", loop.name,
             pole);
      }
    }
    return {};
  }

  Expected<void> locus(LoopFindings& loop) {
    const TransferFunction* transfer = loop.rational();
    const bool late = transfer == nullptr || (!transfer->period() && transfer->delay() > 0.0);
    if (job().view == sisotool && (late || transfer->order() == 0)) {
      if (late) {
        note(result_.diagnostics, "no_locus",
             "there is no root locus of a loop with dead time: it has infinitely many branches; "
             "all else takes the dead time as it is");
      }
      return {};
    }
    if (transfer == nullptr) {
      return tl::unexpected(several_dead_times());
    }
    // Of C G: k is what the locus is about.
    FLYBALL_TRY(const auto without_gain,
                TransferFunction::create(transfer->num() / job().gain, transfer->den(),
                                         transfer->period(), Time(transfer->delay())));
    FLYBALL_TRY(loop.locus, classical::root_locus(
                                without_gain, {.negative = job().negative, .largest_gain = {}}));
    if (job().damping) {
      FLYBALL_TRY(loop.at_damping, classical::locus_at_damping(without_gain, *job().damping));
    }
    if (auto closed = classical::unity_feedback(transfer->delay() > 0.0 ? with_late_poles(*transfer)
                                                                        : *transfer)) {
      FLYBALL_TRY(loop.closed_poles, closed->poles());
    }
    return {};
  }

  /// The delay of a discrete one as poles at z = 0.
  static TransferFunction with_late_poles(const TransferFunction& transfer) {
    const auto late = static_cast<Index>(std::lround(transfer.delay() / transfer.period()->si()));
    VectorXd den = VectorXd::Zero(transfer.den().size() + late);
    den.head(transfer.den().size()) = transfer.den();
    return TransferFunction::create(transfer.num(), den, transfer.period()).value();
  }

  /// All on the frequencies of each.
  Expected<void> bode_curves() {
    std::vector<classical::FrequencyResponse> all;
    std::vector<double> frequencies;
    for (const LoopFindings& loop : result_.loops) {
      FLYBALL_TRY(
          auto response,
          std::visit([](const auto& L) { return classical::frequency_response(L); }, loop.system));
      FLYBALL_TRY(const auto grid, classical::frequency_grid(response, grid_options()));
      frequencies.insert(frequencies.end(), grid.frequency.begin(), grid.frequency.end());
      all.push_back(std::move(response));
    }
    std::sort(frequencies.begin(), frequencies.end());
    frequencies.erase(
        std::unique(frequencies.begin(), frequencies.end(),
                    [](double a, double b) { return std::abs(a - b) <= 1e-12 * std::abs(b); }),
        frequencies.end());
    if (const double highest =
            result_.loops.front().period() ? all.front().highest_frequency() : HUGE_VAL;
        !frequencies.empty()) {
      frequencies.back() = std::min(frequencies.back(), highest);
    }
    result_.frequency =
        Eigen::Map<const VectorXd>(frequencies.data(), static_cast<Index>(frequencies.size()));
    for (std::size_t i = 0; i < all.size(); ++i) {
      FLYBALL_TRY(auto data, classical::bode(all[i], result_.frequency));
      result_.loops[i].bode = std::move(data.curves.front());
    }
    return {};
  }

  /// G/(1 + G H), rational where it can be.
  static Expected<TransferSystem> closed(const TransferSystem& G, const TransferFunction& H) {
    const auto* forward = std::get_if<TransferFunction>(&G);
    if (forward == nullptr || (!forward->period() && forward->delay() + H.delay() > 0.0)) {
      FLYBALL_TRY(const auto late, as_delay_system(G));
      FLYBALL_TRY(const auto back, DelaySystem::create(H));
      return classical::feedback(late, back).map([](DelaySystem&& loop) {
        return TransferSystem(std::move(loop));
      });
    }
    const auto prompt = [](const TransferFunction& transfer) {
      return transfer.delay() > 0.0 ? with_late_poles(transfer) : transfer;
    };
    return classical::feedback(prompt(*forward), prompt(H)).map([](TransferFunction&& loop) {
      return TransferSystem(std::move(loop));
    });
  }

  Expected<LoopResponse> response_of(const TransferSystem& system,
                                     const std::optional<ResponseTimes>& times) const {
    const bool impulse = job().view == LoopView::impulse;
    if (const auto* late = std::get_if<DelaySystem>(&system)) {
      return late_response(*late, impulse, times);
    }
    const auto& shown = std::get<TransferFunction>(system);
    if (shown.order() == 0) {
      LoopResponse response = static_response(
          shown, times ? times->step.si() * static_cast<double>(times->samples) : 1.0);
      if (impulse) {
        return refusal(ArgumentError::out_of_range, to_string(job().view), "the transfer function")
            .got("a gain")
            .expected("one with poles: the impulse response of a gain is an impulse");
      }
      FLYBALL_TRY(response.metrics, classical::step_metrics(shown));
      return response;
    }
    FLYBALL_TRY(auto response, rational_response(shown, impulse, times));
    if (!impulse) {
      FLYBALL_TRY(response.metrics, classical::step_metrics(shown));
    }
    return response;
  }

  Expected<LoopResponse> response_of(const LoopFindings& loop,
                                     const std::optional<ResponseTimes>& times) const {
    if (!job().closed && !in({sisotool, pidtune})) {
      return response_of(loop.system, times);
    }
    FLYBALL_TRY(const auto one,
                TransferFunction::create(VectorXd::Ones(1), VectorXd::Ones(1), loop.period()));
    FLYBALL_TRY(const auto whole, closed(loop.system, one));
    return response_of(whole, times);
  }

  Expected<void> responses() {
    std::vector<LoopResponse> found;
    double end = 0.0;
    const auto period = result_.loops.front().period();
    for (const LoopFindings& loop : result_.loops) {
      std::optional<ResponseTimes> times;
      if (job().duration) {
        times = times_until(job().duration->si(), period);
      }
      auto response = response_of(loop, times);
      if (!response) {
        return tl::unexpected(named(loop, std::move(response).error()));
      }
      end = std::max(end, response->time.back());
      found.push_back(*std::move(response));
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
      // What settles sooner is followed as long as the others.
      if (!job().duration && found[i].time.back() < 0.999 * end) {
        if (auto longer = response_of(result_.loops[i], times_until(end, period))) {
          longer->metrics = found[i].metrics;
          found[i] = *std::move(longer);
        }
      }
      LoopFindings& loop = result_.loops[i];
      loop.response = std::move(found[i]);
      if (loop.pid && loop.margins->stable) {
        FLYBALL_TRY(const auto load, closed(*loop.plant, loop.pid->controller));
        FLYBALL_TRY(loop.load, response_of(load, times_until(loop.response->time.back(), period)));
      }
    }
    return {};
  }

  static ResponseTimes times_until(double end, const std::optional<Time>& period) {
    constexpr Index most = 100'000;
    if (period) {
      const double samples = std::floor(end / period->si() * (1.0 + 1e-12)) + 1.0;
      return {*period, static_cast<Index>(std::min(samples, static_cast<double>(most)))};
    }
    constexpr Index steps = 1000;
    return {Time(end / static_cast<double>(steps)), steps + 1};
  }

  LoopResult result_;
};

}  // namespace

std::optional<Time> LoopFindings::period() const {
  return std::visit([](const auto& L) { return std::optional<Time>(L.period()); }, system);
}

double LoopFindings::dc_gain() const {
  const TransferFunction* transfer = rational();
  return transfer != nullptr ? transfer->dc_gain() : std::get<DelaySystem>(system).dc_gain()(0, 0);
}

std::vector<double> LoopFindings::delays() const {
  if (const TransferFunction* transfer = rational()) {
    return transfer->delay() > 0.0 ? std::vector{transfer->delay()} : std::vector<double>{};
  }
  std::vector<double> all = listed(std::get<DelaySystem>(system).delays());
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

ExpectedAll<LoopResult> study_loops(const LoopJob& job) {
  if (job.expressions.empty()) {
    return tl::unexpected(Errors(Error(ArgumentError::empty)
                                     .in(std::string(to_string(job.view)))
                                     .about("the transfer functions")));
  }
  return Study(job).run();
}

}  // namespace flyball::study
