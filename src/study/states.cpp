#include <flyball/study/states.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>

#include "core/try.hpp"
#include "core/wording.hpp"

namespace flyball::study {

namespace {

constexpr std::string_view in_states = "states";
constexpr std::size_t most_moves = 200'000;

using StatePlace = std::vector<double>;

std::string quoted_state(const std::string& name) {
  return cut(printable(name), 60);
}

/// "height = 0.5 m, arm = 1.2 rad".
std::string place_text(const ConfigurationSpace& space, const StatePlace& q) {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < q.size(); ++i) {
    const SpaceAxis& axis = space.axes()[i];
    words.push_back(fmt::format("{} = {}{}{}", quoted_state(axis.name), text::number(q[i]),
                                axis.unit.empty() ? "" : " ", axis.unit));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

/// A set alone, to judge moves by.
struct SetSpace {
  std::string name;
  ConfigurationSpace space;
};

/// What a move came to.
struct Judged {
  bool free = true;
  double share = 1.0;  ///< Of its way.
  StatePlace at{};
  std::string broken{};
};

class Machine {
 public:
  static Expected<Machine> create(const StatesJob& job) {
    Machine machine(job);
    FLYBALL_CHECK(machine.check());
    for (const NamedSet& set : job.sets) {
      FLYBALL_TRY(ConfigurationSpace space, ConfigurationSpace::create(job.space.axes()));
      FLYBALL_CHECK(space.require(set.name, set.region));
      machine.sets_.push_back({set.name, std::move(space)});
    }
    return machine;
  }

  [[nodiscard]] std::size_t state_of(const std::string& name) const { return states_.at(name); }
  [[nodiscard]] const std::vector<std::string>& events() const { return events_; }

  /// The transition of an event, or nothing.
  [[nodiscard]] const MachineTransition* transition(std::size_t state,
                                                    const std::string& event) const {
    for (const std::string& from : {job_->states[state].name, std::string("*")}) {
      const auto found = transitions_.find({from, event});
      if (found != transitions_.end()) {
        return found->second;
      }
    }
    return nullptr;
  }

  /// The corners of a transition's way from a place.
  [[nodiscard]] std::vector<StatePlace> way(const StatePlace& from,
                                            const MachineTransition& transition) const {
    std::vector<StatePlace> corners{from};
    std::vector<StatePlace> goals = transition.via;
    goals.push_back(job_->states[state_of(transition.to)].at);
    for (const StatePlace& goal : goals) {
      const StatePlace difference = job_->space.difference(corners.back(), goal);
      if (transition.order.empty()) {
        corners.push_back(sum(corners.back(), difference));
        continue;
      }
      std::vector<bool> moved(goal.size(), false);
      for (std::size_t k = 0; k < transition.order.size(); ++k) {
        StatePlace next = corners.back();
        const auto move = [&](std::size_t i) {
          next[i] += difference[i];
          moved[i] = true;
        };
        move(static_cast<std::size_t>(transition.order[k]));
        if (k + 1 == transition.order.size()) {
          for (std::size_t i = 0; i < goal.size(); ++i) {
            if (!moved[i]) {
              move(i);
            }
          }
        }
        corners.push_back(std::move(next));
      }
    }
    return corners;
  }

  /// A place on a way. @param share  Of its length.
  [[nodiscard]] StatePlace along(const std::vector<StatePlace>& corners, double share) const {
    const double whole = length(corners);
    double left = share * whole;
    for (std::size_t i = 1; i < corners.size(); ++i) {
      const StatePlace step = subtract(corners[i], corners[i - 1]);
      const double l = job_->space.length(step);
      if (left <= l || i + 1 == corners.size()) {
        const double s = l > 0.0 ? std::min(left / l, 1.0) : 1.0;
        StatePlace at = corners[i - 1];
        for (std::size_t k = 0; k < at.size(); ++k) {
          at[k] += s * step[k];
        }
        return at;
      }
      left -= l;
    }
    return corners.back();
  }

  [[nodiscard]] Judged judge(const std::vector<StatePlace>& corners,
                             const std::vector<std::string>& within) const {
    const double whole = length(corners);
    double done = 0.0;
    for (std::size_t i = 1; i < corners.size(); ++i) {
      const StatePlace step = subtract(corners[i], corners[i - 1]);
      const double l = job_->space.length(step);
      Judged first;
      const auto look = [&](const ConfigurationSpace& space, const std::string& set) {
        const MoveCheck check = space.check_move(corners[i - 1], step);
        const double share = whole > 0.0 ? (done + check.at * l) / whole : 0.0;
        if (!check.free && (first.free || share < first.share)) {
          StatePlace at = corners[i - 1];
          for (std::size_t k = 0; k < at.size(); ++k) {
            at[k] += check.at * step[k];
          }
          first = {false, share, std::move(at), set.empty() ? check.constraint : set};
        }
      };
      look(job_->space, "");
      for (const std::string& name : within) {
        look(set_space(name), name);
      }
      if (!first.free) {
        return first;
      }
      done += l;
    }
    return {};
  }

  [[nodiscard]] bool is_within(const StatePlace& q, const std::string& set) const {
    return set_space(set).valid(q);
  }

 private:
  explicit Machine(const StatesJob& job) : job_(&job) {}

  static StatePlace sum(StatePlace a, const StatePlace& b) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] += b[i];
    }
    return a;
  }
  static StatePlace subtract(StatePlace a, const StatePlace& b) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] -= b[i];
    }
    return a;
  }
  [[nodiscard]] double length(const std::vector<StatePlace>& corners) const {
    double whole = 0.0;
    for (std::size_t i = 1; i < corners.size(); ++i) {
      whole += job_->space.length(subtract(corners[i], corners[i - 1]));
    }
    return whole;
  }
  [[nodiscard]] const ConfigurationSpace& set_space(const std::string& name) const {
    return std::find_if(sets_.begin(), sets_.end(),
                        [&](const SetSpace& set) { return set.name == name; })
        ->space;
  }

  Expected<void> check_place(const StatePlace& q, const std::string& name) const {
    if (q.size() != static_cast<std::size_t>(job_->space.dimension())) {
      return refusal(ArgumentError::wrong_shape, in_states, name)
          .got(fmt::format("of {} numbers", q.size()))
          .expected(fmt::format("one a coordinate: {}", job_->space.dimension()));
    }
    for (const double value : q) {
      if (!std::isfinite(value)) {
        return refusal(ArgumentError::not_finite, in_states, name)
            .got(fmt::format("{}", value))
            .expected("finite");
      }
    }
    return {};
  }
  Expected<void> check_sets(const std::vector<std::string>& names, const std::string& of) const {
    for (const std::string& name : names) {
      const bool there = std::any_of(job_->sets.begin(), job_->sets.end(),
                                     [&](const NamedSet& set) { return set.name == name; });
      if (!there) {
        return unknown(name, "a set", of, [&] {
          std::vector<std::string_view> all;
          for (const NamedSet& set : job_->sets) {
            all.push_back(set.name);
          }
          return all;
        }());
      }
    }
    return {};
  }
  static tl::unexpected<Error> unknown(const std::string& name, std::string_view what,
                                       const std::string& of,
                                       const std::vector<std::string_view>& known) {
    const std::string near = nearest_name(name, known);
    return refusal(ArgumentError::unknown_name, in_states,
                   fmt::format("\"{}\" of {}", quoted_state(name), of))
        .got(fmt::format("not there as {}", what))
        .expected(fmt::format("one of {}", cut(fmt::format("{}", fmt::join(known, ", ")), 200)))
        .hint(near.empty() ? "" : fmt::format("did you mean \"{}\"?", quoted_state(near)));
  }

  Expected<void> check() {
    if (job_->states.empty()) {
      return refusal(ArgumentError::empty, in_states, "the machine").got("without states");
    }
    if (job_->depth < 1 || job_->depth > 100) {
      return refusal(ArgumentError::out_of_range, in_states, "depth")
          .got(fmt::format("{}", job_->depth))
          .expected("from 1 to 100");
    }
    if (job_->interrupts < 0 || job_->interrupts > 20) {
      return refusal(ArgumentError::out_of_range, in_states, "interrupts")
          .got(fmt::format("{}", job_->interrupts))
          .expected("from 0 to 20");
    }
    std::vector<std::string_view> names;
    for (std::size_t i = 0; i < job_->states.size(); ++i) {
      const MachineState& state = job_->states[i];
      const std::string called = fmt::format("state \"{}\"", quoted_state(state.name));
      if (state.name.empty() || state.name == "*" || !states_.emplace(state.name, i).second) {
        return refusal(ArgumentError::ambiguous_name, in_states, called)
            .got("there twice, empty or \"*\"")
            .expected("a name of its own");
      }
      names.push_back(state.name);
      FLYBALL_CHECK(check_place(state.at, called));
      FLYBALL_CHECK(check_sets(state.within, called));
    }
    if (states_.count(job_->start) == 0) {
      return unknown(job_->start, "a state", "start", names);
    }
    std::set<std::string> events;
    for (const MachineTransition& transition : job_->transitions) {
      const std::string called =
          fmt::format("the transition of \"{}\" by \"{}\"", quoted_state(transition.from),
                      quoted_state(transition.event));
      if (transition.from != "*" && states_.count(transition.from) == 0) {
        return unknown(transition.from, "a state", called, names);
      }
      if (states_.count(transition.to) == 0) {
        return unknown(transition.to, "a state", called, names);
      }
      if (!transitions_.emplace(std::pair(transition.from, transition.event), &transition).second) {
        return refusal(ArgumentError::ambiguous_name, in_states, called)
            .got("there twice")
            .expected("one transition of a state and an event");
      }
      for (const StatePlace& place : transition.via) {
        FLYBALL_CHECK(check_place(place, called));
      }
      std::set<int> order;
      for (const int coordinate : transition.order) {
        if (coordinate < 0 || coordinate >= job_->space.dimension() ||
            !order.insert(coordinate).second) {
          return refusal(ArgumentError::out_of_range, in_states, called)
              .got("with an order of coordinates that are not there, or twice")
              .expected("each coordinate at most once");
        }
      }
      FLYBALL_CHECK(check_sets(transition.within, called));
      events.insert(transition.event);
    }
    events_.assign(events.begin(), events.end());
    for (const MachineSequence& sequence : job_->sequences) {
      const std::string called = fmt::format("sequence \"{}\"", quoted_state(sequence.name));
      FLYBALL_CHECK(check_sets(sequence.within, called));
      if (!sequence.states.empty() && sequence.states.size() != sequence.events.size()) {
        return refusal(ArgumentError::wrong_shape, in_states, called)
            .got(fmt::format("of {} events and {} states", sequence.events.size(),
                             sequence.states.size()))
            .expected("a state after each event");
      }
      for (const std::string& state : sequence.states) {
        if (states_.count(state) == 0) {
          return unknown(state, "a state", called, names);
        }
      }
      std::vector<std::string_view> known(events_.begin(), events_.end());
      for (const std::string& event : sequence.events) {
        if (events.count(event) == 0) {
          return unknown(event, "an event of a transition", called, known);
        }
      }
    }
    return job_->space.check(job_->states[states_.at(job_->start)].at, in_states,
                             fmt::format("the start, \"{}\",", quoted_state(job_->start)));
  }

  const StatesJob* job_;
  std::map<std::string, std::size_t> states_;
  std::map<std::pair<std::string, std::string>, const MachineTransition*> transitions_;
  std::vector<std::string> events_;
  std::vector<SetSpace> sets_;
};

/// A place in which the machine can be, and how it got there.
struct Node {
  std::size_t state = 0;
  StatePlace at{};
  std::size_t parent = 0;
  const MachineTransition* by = nullptr;
  double share = 1.0;  ///< Of the way of `by` at which the next event comes.
  int depth = 0;
};

std::string explain(const StatesJob& job, const MachineViolation& violation) {
  std::string text = fmt::format(
      "After {}, \"{}\" moves from {} to {}",
      violation.events.size() == 1
          ? std::string("the start")
          : fmt::format("{}",
                        fmt::join(violation.events.begin(), violation.events.end() - 1, ", then ")),
      quoted_state(violation.events.back()), quoted_state(violation.from),
      quoted_state(violation.to));
  if (!violation.arrived.empty() && violation.arrived.back() < 1.0) {
    text += fmt::format(" while the move before is at {}", text::percent(violation.arrived.back()));
  }
  text += fmt::format(": {} of the way on, at {}, {} is broken", text::percent(violation.share),
                      place_text(job.space, violation.at), quoted_state(violation.broken));
  return printable(text) + ".";
}

/// What is wrong with a move or with where it ends.
std::optional<MachineViolation> violation_of(const StatesJob& job, const Machine& machine,
                                             const std::vector<StatePlace>& corners,
                                             std::size_t from, const MachineTransition& transition,
                                             std::vector<std::string> more_within) {
  more_within.insert(more_within.end(), transition.within.begin(), transition.within.end());
  const Judged judged = machine.judge(corners, more_within);
  const MachineState& goal = job.states[machine.state_of(transition.to)];
  MachineViolation violation{.from = job.states[from].name, .to = goal.name};
  violation.before = corners.front();
  if (!judged.free) {
    violation.broken = judged.broken;
    violation.at = judged.at;
    violation.share = judged.share;
    return violation;
  }
  for (const std::string& set : goal.within) {
    if (!machine.is_within(corners.back(), set)) {
      violation.broken = set;
      violation.at = corners.back();
      violation.share = 1.0;
      return violation;
    }
  }
  return std::nullopt;
}

SequenceResult replay(const StatesJob& job, const Machine& machine,
                      const MachineSequence& sequence) {
  SequenceResult result{.name = sequence.name, .states = {job.start}};
  std::size_t state = machine.state_of(job.start);
  StatePlace at = job.states[state].at;
  result.way.push_back(at);
  for (std::size_t k = 0; k < sequence.events.size(); ++k) {
    const std::string& event = sequence.events[k];
    const MachineTransition* transition = machine.transition(state, event);
    const std::vector<std::string> so_far(
        sequence.events.begin(), sequence.events.begin() + static_cast<std::ptrdiff_t>(k) + 1);
    const std::string before = job.states[state].name;
    if (transition != nullptr) {
      const std::vector<StatePlace> corners = machine.way(at, *transition);
      if (auto violation =
              violation_of(job, machine, corners, state, *transition, sequence.within)) {
        violation->events = so_far;
        violation->arrived.assign(k, 1.0);
        violation->sequence = sequence.name;
        violation->explanation = explain(job, *violation);
        result.violation = std::move(violation);
        return result;
      }
      result.way.insert(result.way.end(), corners.begin() + 1, corners.end());
      at = corners.back();
      state = machine.state_of(transition->to);
    }
    result.states.push_back(job.states[state].name);
    const bool unknown = transition == nullptr && job.strict;
    if (unknown || (!sequence.states.empty() && sequence.states[k] != job.states[state].name)) {
      MachineViolation violation{
          .events = so_far,
          .arrived = std::vector<double>(k, 1.0),
          .from = before,
          .to = job.states[state].name,
          .broken = unknown ? "an event that the state does not know" : "the expected state",
          .before = at,
          .at = at,
          .share = 1.0,
          .sequence = sequence.name};
      violation.explanation =
          unknown
              ? fmt::format("\"{}\" comes in {}, which has no transition for it.",
                            quoted_state(event), quoted_state(before))
              : fmt::format("After \"{}\" in {} the machine is in {}, not in {}.",
                            quoted_state(event), quoted_state(before),
                            quoted_state(job.states[state].name), quoted_state(sequence.states[k]));
      result.violation = std::move(violation);
      return result;
    }
  }
  return result;
}

/// Places that are one.
std::vector<long long> key_of(std::size_t state, const StatePlace& at) {
  constexpr double grain = 1e-9;
  std::vector<long long> key{static_cast<long long>(state)};
  for (const double value : at) {
    key.push_back(std::llround(std::clamp(value, -1e8, 1e8) / grain));
  }
  return key;
}

void explore(const StatesJob& job, const Machine& machine, StatesResult& result) {
  std::vector<Node> nodes{{.state = machine.state_of(job.start)}};
  nodes.front().at = job.states[nodes.front().state].at;
  std::set<std::vector<long long>> known{key_of(nodes.front().state, nodes.front().at)};
  std::set<std::size_t> reached{nodes.front().state};
  std::set<std::string> ignored;
  constexpr std::size_t most_ways = 60;  // drawn
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (nodes[n].depth >= job.depth || !result.complete) {
      break;
    }
    result.depth_reached = std::max(result.depth_reached, nodes[n].depth + 1);
    for (const std::string& event : machine.events()) {
      const Node node = nodes[n];
      const MachineTransition* transition = machine.transition(node.state, event);
      const auto events_to = [&] {
        std::vector<std::string> events{event};
        std::vector<double> arrived;
        for (std::size_t k = n; nodes[k].by != nullptr; k = nodes[k].parent) {
          events.push_back(nodes[k].by->event);
          arrived.push_back(nodes[k].share);
        }
        std::reverse(events.begin(), events.end());
        std::reverse(arrived.begin(), arrived.end());
        return std::pair(events, arrived);
      };
      if (transition == nullptr) {
        ignored.insert(fmt::format("{} in {}", quoted_state(event),
                                   quoted_state(job.states[node.state].name)));
        if (job.strict) {
          MachineViolation violation{.from = job.states[node.state].name,
                                     .to = job.states[node.state].name,
                                     .broken = "an event that the state does not know",
                                     .before = node.at,
                                     .at = node.at,
                                     .share = 0.0};
          std::tie(violation.events, violation.arrived) = events_to();
          violation.explanation = fmt::format("\"{}\" comes in {}, which has no transition for it.",
                                              quoted_state(event), quoted_state(violation.from));
          result.violation = std::move(violation);
          return;
        }
        continue;
      }
      if (result.moves >= most_moves) {
        result.complete = false;
        break;
      }
      ++result.moves;
      const std::vector<StatePlace> corners = machine.way(node.at, *transition);
      if (result.ways.size() < most_ways) {
        result.ways.push_back(corners);
      }
      if (auto violation = violation_of(job, machine, corners, node.state, *transition, {})) {
        std::tie(violation->events, violation->arrived) = events_to();
        violation->explanation = explain(job, *violation);
        result.violation = std::move(violation);
        return;
      }
      const std::size_t to = machine.state_of(transition->to);
      reached.insert(to);
      for (int k = 1; k <= job.interrupts + 1; ++k) {
        const double share = static_cast<double>(k) / (job.interrupts + 1);
        StatePlace at = k == job.interrupts + 1 ? corners.back() : machine.along(corners, share);
        if (known.insert(key_of(to, at)).second) {
          nodes.push_back({to, std::move(at), n, transition, share, node.depth + 1});
        }
      }
    }
    if (!result.complete) {
      break;
    }
  }
  // Every event may come at each depth, at each of its places.
  const double branches = static_cast<double>(machine.events().size()) * (job.interrupts + 1);
  double at_depth = static_cast<double>(machine.events().size());
  for (int d = 1; d <= job.depth; ++d) {
    result.sequences_explored += at_depth;
    at_depth *= branches;
  }
  for (const MachineState& state : job.states) {
    if (reached.count(machine.state_of(state.name)) == 0) {
      result.unreached.push_back(state.name);
    }
  }
  result.unknown_events.assign(ignored.begin(), ignored.end());
}

}  // namespace

Expected<StatesResult> validate_state_machine(const StatesJob& job) {
  FLYBALL_TRY(const Machine machine, Machine::create(job));
  StatesResult result{.job = job};
  for (const MachineSequence& sequence : job.sequences) {
    result.sequences.push_back(replay(job, machine, sequence));
  }
  explore(job, machine, result);
  return result;
}

}  // namespace flyball::study
