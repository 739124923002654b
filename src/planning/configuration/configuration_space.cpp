#include <flyball/planning/configuration/configuration_space.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include <flyball/core/argument.hpp>

#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/configuration/space_checks.hpp"
#include "planning/configuration/space_model.hpp"

namespace flyball {

using detail::SpaceConstraint;
using detail::SpaceModel;

ErrorInfo error_info(ConfigurationError code) {
  constexpr detail::ErrorRow rows[] = {
      {"in_collision", "a configuration breaks a constraint", ErrorKind::no_answer},
      {"blocked_move", "a move between configurations breaks a constraint", ErrorKind::no_answer},
      {"no_path", "no path exists", ErrorKind::no_answer},
      {"undecided", "no path was found, and no proof that there is none", ErrorKind::no_answer},
  };
  return detail::info_of(code, "configuration", rows);
}

namespace {

constexpr std::string_view in_configuration_space = "configuration space";

/// What rounding may make of a margin of 0, in shares of the axes' scales.
constexpr double touch = 1e-11;

/// Room for rates of a program without asking for memory, mostly.
class Rates {
 public:
  Rates(const detail::SpaceProgram<double>& program, const double* by) {
    const std::size_t count = program.rate_count();
    double* to = few_.data();
    if (count > few_.size()) {
      many_.resize(count);
      to = many_.data();
    }
    rates_ = detail::inverse_rates(program, by, to);
  }
  [[nodiscard]] const detail::InverseRates<double>& get() const noexcept { return rates_; }

 private:
  std::array<double, 128> few_;
  std::vector<double> many_{};
  detail::InverseRates<double> rates_{};
};

/// The rates that were computed for a move of every axis by its scale.
detail::InverseRates<double> unit_rates(const detail::SpaceProgram<double>& program,
                                        const std::vector<double>& kept) noexcept {
  double* const first = const_cast<double*>(kept.data());
  return {first, first + program.bodies.size(),
          first + program.bodies.size() + program.pairs.size(),
          first + program.bodies.size() + program.pairs.size() + program.holds.size()};
}

bool usable(const SpaceModel& model, std::span<const double> q) {
  return q.size() == model.axes.size() &&
         std::all_of(q.begin(), q.end(), [](double x) { return std::abs(x) < 1e9; });
}

/// Of the stops, in shares of the axes' scales.
double stop_clearance(const SpaceModel& model, std::span<const double> q) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < q.size(); ++k) {
    const SpaceAxis& axis = model.axes[k];
    if (!axis.wraps) {
      least = std::min(least, std::min(q[k] - axis.low, axis.high - q[k]) / axis.scale);
    }
  }
  return least;
}

std::string stop_name(const SpaceAxis& axis, std::size_t k) {
  return (axis.name.empty() ? "axis " + std::to_string(k + 1) : axis.name) + " beyond its stops";
}

/// The margin of one constraint, in its own unit if everything in it has one rate.
double margin_of(const SpaceConstraint& constraint, std::span<const double> q) {
  // 1/rate of 1 everywhere: the numbers themselves.
  const std::vector<double> ones(constraint.unit_rates.size(), 1.0);
  return detail::reach_of(constraint.program.view(), q.data(),
                          unit_rates(constraint.program, ones));
}

}  // namespace

ConfigurationSpace::ConfigurationSpace(std::shared_ptr<const SpaceModel> model)
    : model_(std::move(model)) {}

Expected<ConfigurationSpace> ConfigurationSpace::create(std::vector<SpaceAxis> axes) {
  FLYBALL_CHECK(detail::check_axes(axes));
  auto model = std::make_shared<SpaceModel>();
  model->buffer.assign(axes.size(), 0.0);
  model->axes = std::move(axes);
  detail::complete(*model);
  return ConfigurationSpace(std::move(model));
}

Expected<void> ConfigurationSpace::require(std::string name, const Region& region) {
  return constrain({{std::move(name), region, false}});
}

Expected<void> ConfigurationSpace::forbid(std::string name, const Region& region) {
  return constrain({{std::move(name), region, true}});
}

Expected<void> ConfigurationSpace::takes(const NamedRegion& region) const {
  return detail::check_region(model_->axes, region.name, region.region);
}

Expected<void> ConfigurationSpace::constrain(std::vector<NamedRegion> regions) {
  for (const NamedRegion& region : regions) {
    FLYBALL_CHECK(takes(region));
  }
  auto model = std::make_shared<SpaceModel>(*model_);
  std::move(regions.begin(), regions.end(), std::back_inserter(model->regions));
  detail::complete(*model);
  model_ = std::move(model);
  return {};
}

Expected<void> ConfigurationSpace::attach(const PlanarMechanism& mechanism) {
  if (model_->mechanism) {
    return refusal(ArgumentError::ambiguous_name, in_configuration_space, "mechanism")
        .got("attached twice")
        .expected("once")
        .hint("joints without a parent make several mechanisms one");
  }
  FLYBALL_CHECK(detail::check_mechanism(model_->axes, mechanism));
  auto model = std::make_shared<SpaceModel>(*model_);
  model->mechanism = mechanism;
  detail::complete(*model);
  model_ = std::move(model);
  return {};
}

Expected<ConfigurationSpace> ConfigurationSpace::with_buffer(std::span<const double> error) const {
  if (error.size() != model_->axes.size()) {
    return refusal(ArgumentError::wrong_shape, in_configuration_space, "buffer")
        .got(detail::format("{} entries", error.size()))
        .expected(detail::format("one for each of the {} axes", model_->axes.size()));
  }
  auto model = std::make_shared<SpaceModel>(*model_);
  for (std::size_t k = 0; k < error.size(); ++k) {
    SpaceAxis& axis = model->axes[k];
    FLYBALL_CHECK(
        check_not_negative(error[k], in_configuration_space, "buffer of " + axis.name, axis.unit));
    model->buffer[k] += error[k];
    if (!axis.wraps) {
      axis.low += error[k];
      axis.high -= error[k];
    }
    if (!(axis.low < axis.high)) {
      return refusal(ArgumentError::out_of_range, in_configuration_space, "buffer of " + axis.name)
          .got(format_number(error[k]) + (axis.unit.empty() ? "" : " " + axis.unit))
          .expected("less than half of the way between its stops");
    }
  }
  detail::complete(*model);
  return ConfigurationSpace(std::move(model));
}

int ConfigurationSpace::dimension() const noexcept {
  return model_->dimension();
}

const std::vector<SpaceAxis>& ConfigurationSpace::axes() const noexcept {
  return model_->axes;
}

std::vector<std::string> ConfigurationSpace::constraints() const {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < model_->axes.size(); ++k) {
    if (!model_->axes[k].wraps) {
      names.push_back(stop_name(model_->axes[k], k));
    }
  }
  for (const SpaceConstraint& constraint : model_->constraints) {
    names.push_back(constraint.name);
  }
  return names;
}

const PlanarMechanism* ConfigurationSpace::mechanism() const noexcept {
  return model_->mechanism ? &*model_->mechanism : nullptr;
}

const std::vector<ConfigurationSpace::NamedRegion>& ConfigurationSpace::regions() const noexcept {
  return model_->regions;
}

bool ConfigurationSpace::valid(std::span<const double> q) const {
  return usable(*model_, q) && clearance(q) >= -touch;
}

double ConfigurationSpace::clearance(std::span<const double> q) const {
  if (!usable(*model_, q)) {
    return -std::numeric_limits<double>::infinity();
  }
  return std::min(stop_clearance(*model_, q),
                  detail::reach_of(model_->exact.view(), q.data(),
                                   unit_rates(model_->exact, model_->unit_rates)));
}

std::vector<ConstraintState> ConfigurationSpace::margins(std::span<const double> q) const {
  std::vector<ConstraintState> all;
  if (!usable(*model_, q)) {
    return all;
  }
  for (std::size_t k = 0; k < q.size(); ++k) {
    const SpaceAxis& axis = model_->axes[k];
    if (!axis.wraps) {
      all.push_back({stop_name(axis, k), std::min(q[k] - axis.low, axis.high - q[k]), axis.unit});
    }
  }
  for (const SpaceConstraint& constraint : model_->constraints) {
    all.push_back({constraint.name, margin_of(constraint, q), constraint.unit});
  }
  return all;
}

std::vector<ConstraintState> ConfigurationSpace::broken(std::span<const double> q) const {
  std::vector<std::pair<double, ConstraintState>> found;
  if (!usable(*model_, q)) {
    return {};
  }
  for (std::size_t k = 0; k < q.size(); ++k) {
    const SpaceAxis& axis = model_->axes[k];
    const double margin = std::min(q[k] - axis.low, axis.high - q[k]);
    if (!axis.wraps && margin < -touch * axis.scale) {
      found.push_back({margin / axis.scale, {stop_name(axis, k), margin, axis.unit}});
    }
  }
  for (const SpaceConstraint& constraint : model_->constraints) {
    const double share = detail::reach_of(constraint.program.view(), q.data(),
                                          unit_rates(constraint.program, constraint.unit_rates));
    if (share < -touch) {
      found.push_back({share, {constraint.name, margin_of(constraint, q), constraint.unit}});
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<ConstraintState> all;
  for (auto& [share, state] : found) {
    all.push_back(std::move(state));
  }
  return all;
}

namespace {

/// Of distances in all coordinates together: "rad", "m or rad".
std::string units_of(const std::vector<SpaceAxis>& axes) {
  std::vector<std::string_view> all;
  std::string text;
  for (const SpaceAxis& axis : axes) {
    if (!axis.unit.empty() && std::find(all.begin(), all.end(), axis.unit) == all.end()) {
      text += (all.empty() ? "" : " or ") + axis.unit;
      all.push_back(axis.unit);
    }
  }
  return text;
}

}  // namespace

Expected<void> ConfigurationSpace::check(std::span<const double> q, std::string_view place,
                                         std::string_view name) const {
  if (q.size() != model_->axes.size()) {
    return refusal(ArgumentError::wrong_shape, place, name)
        .got(detail::format("{} numbers", q.size()))
        .expected(detail::format("one for each of the {} axes", model_->axes.size()));
  }
  for (std::size_t k = 0; k < q.size(); ++k) {
    FLYBALL_CHECK(check_finite(q[k], place, std::string(name) + ", " + model_->axes[k].name));
    if (!(std::abs(q[k]) < 1e9)) {
      return refusal(ArgumentError::out_of_range, place, name)
          .got(format_number(q[k]))
          .expected("within the stops");
    }
  }
  if (valid(q)) {
    return {};
  }
  const std::vector<ConstraintState> all = broken(q);
  Refusal error = refusal(ConfigurationError::in_collision, place, name);
  if (!all.empty()) {
    const auto worded = [&](const ConstraintState& one) {
      const std::string unit = one.unit.empty() ? units_of(model_->axes) : one.unit;
      return one.name + detail::format(" by {:.3g}", -one.margin) +
             (unit.empty() ? "" : " " + unit);
    };
    std::string got = "in breach of " + worded(all[0]);
    for (std::size_t i = 1; i < std::min<std::size_t>(all.size(), 3); ++i) {
      got += "; " + worded(all[i]);
    }
    if (all.size() > 3) {
      got += detail::format("; and {} more", all.size() - 3);
    }
    error = std::move(error).got(std::move(got));
  }
  return std::move(error)
      .expected("a configuration that breaks no constraint")
      .with("configuration", std::vector<double>(q.begin(), q.end()));
}

std::vector<double> ConfigurationSpace::difference(std::span<const double> from,
                                                   std::span<const double> to) const {
  std::vector<double> by(model_->axes.size(), 0.0);
  for (std::size_t k = 0; k < by.size() && k < from.size() && k < to.size(); ++k) {
    by[k] = to[k] - from[k];
    if (model_->axes[k].wraps) {
      by[k] = std::remainder(by[k], 2.0 * std::numbers::pi);
    }
  }
  return by;
}

double ConfigurationSpace::length(std::span<const double> difference) const {
  double squared = 0.0;
  for (std::size_t k = 0; k < model_->axes.size() && k < difference.size(); ++k) {
    const double d = difference[k] / model_->axes[k].scale;
    squared += d * d;
  }
  return std::sqrt(squared);
}

MoveCheck ConfigurationSpace::check_move(std::span<const double> from,
                                         std::span<const double> by) const {
  const SpaceModel& model = *model_;
  if (!usable(model, from) || !usable(model, by)) {
    return {false, 0.0, "numbers that are not of the space"};
  }
  MoveCheck result{true, 1.0, {}};
  const auto stop = [&](double at, const std::string& name) {
    if (result.free || at < result.at) {
      result = {false, at, name};
    }
  };
  for (std::size_t k = 0; k < by.size(); ++k) {
    const SpaceAxis& axis = model.axes[k];
    if (axis.wraps) {
      continue;
    }
    const double near = touch * axis.scale;
    const double end = from[k] + by[k];
    if (from[k] < axis.low - near || from[k] > axis.high + near) {
      stop(0.0, stop_name(axis, k));
    } else if (end < axis.low - near || end > axis.high + near) {
      stop(std::clamp(((end < axis.low ? axis.low : axis.high) - from[k]) / by[k], 0.0, 1.0),
           stop_name(axis, k));
    }
  }
  for (const SpaceConstraint& constraint : model.constraints) {
    if (constraint.region) {
      const double exit = detail::first_exit(model, constraint, from.data(), by.data());
      if (exit <= 1.0) {
        stop(exit, constraint.name);
      }
    }
  }
  if (model.contacts.rate_count() == 0) {
    return result;
  }
  const detail::SpaceView<double> view = model.contacts.view();
  const Rates rates(model.contacts, by.data());
  std::array<double, detail::most_axes> q{};
  constexpr double nearest = 1e-9;
  constexpr int most_steps = 1'000'000;
  double s = 0.0;
  for (int i = 0; i < most_steps; ++i) {
    for (std::size_t k = 0; k < by.size(); ++k) {
      q[k] = from[k] + s * by[k];
    }
    const double reach = detail::reach_of(view, q.data(), rates.get());
    if (!(reach > nearest)) {
      break;
    }
    s += reach;
    if (s >= (result.free ? 1.0 : result.at)) {
      return result;
    }
  }
  // The constraint with the least left is the one that stops it.
  double least = std::numeric_limits<double>::infinity();
  std::string name;
  for (const SpaceConstraint& constraint : model.constraints) {
    if (constraint.region) {
      continue;
    }
    const Rates own(constraint.program, by.data());
    const double reach = detail::reach_of(constraint.program.view(), q.data(), own.get());
    if (reach < least) {
      least = reach;
      name = constraint.name;
    }
  }
  stop(std::min(s, 1.0), name);
  return result;
}

}  // namespace flyball
