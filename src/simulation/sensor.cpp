#include <flyball/simulation/sensor.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>

namespace flyball {

Expected<Sensor> Sensor::create(const SensorModel& model, Time step, Random random) {
  constexpr std::string_view where = "Sensor";
  return Checks(where)
      .not_negative(model.resolution, "resolution")
      .not_negative(model.noise, "noise")
      .not_negative(model.delay.si(), "delay", "s")
      .not_negative(model.refresh.si(), "refresh", "s")
      .not_negative(model.moving_average.si(), "moving_average", "s")
      .positive(step.si(), "step", "s")
      .map([&] { return Sensor(model, step, random); });
}

void Sensor::record(double truth) {
  const double area = truth_.empty() ? 0.0 : 0.5 * (truth_.back() + truth) * step_;
  integral_.push_back(integral_.empty() ? 0.0 : integral_.back() + area);
  truth_.push_back(truth);
}

double Sensor::truth_at(double time) const {
  const double place = time / step_;
  if (place <= 0.0) {
    return truth_.front();
  }
  const auto last = static_cast<double>(truth_.size() - 1);
  if (place >= last) {
    return truth_.back();
  }
  const auto index = static_cast<std::size_t>(place);
  const double share = place - static_cast<double>(index);
  return truth_[index] + share * (truth_[index + 1] - truth_[index]);
}

double Sensor::mean(double from, double to) const {
  // The integral of the truth's polyline up to a time.
  const auto integral = [this](double time) {
    const auto last = static_cast<double>(truth_.size() - 1);
    const double place = std::clamp(time / step_, 0.0, last);
    const auto index = static_cast<std::size_t>(place);
    const double within = place * step_ - static_cast<double>(index) * step_;
    const double before = time < 0.0 ? time * truth_.front() : 0.0;
    return before + integral_[index] + 0.5 * within * (truth_[index] + truth_at(place * step_));
  };
  return (integral(to) - integral(from)) / (to - from);
}

double Sensor::read() {
  if (truth_.empty()) {
    return 0.0;
  }
  const auto last = static_cast<long long>(truth_.size() - 1);
  const double now = static_cast<double>(last) * step_;
  // Far shorter than a record, it is none.
  const double refresh = model_.refresh.si() >= 1e-6 * step_ ? model_.refresh.si() : 0.0;
  // A refresh that falls on a record happens at it, whatever the rounding of their quotient.
  constexpr double rounding = 1e-9;
  const long long index =
      refresh > 0.0 ? static_cast<long long>(std::floor(now / refresh + rounding)) : last;
  if (index == reading_index_) {
    return reading_;
  }
  reading_index_ = index;
  const double fresh = refresh > 0.0 ? static_cast<double>(index) * refresh : now;
  const double seen = fresh - model_.delay.si();
  const double window = model_.moving_average.si();
  double value = window > 0.0 ? mean(seen - window, seen) : truth_at(seen);
  if (model_.noise > 0.0) {
    value += random_.normal(0.0, model_.noise);
  }
  reading_ =
      model_.resolution > 0.0 ? std::round(value / model_.resolution) * model_.resolution : value;
  return reading_;
}

}  // namespace flyball
