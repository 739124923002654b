#pragma once

#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/core/random.hpp>

namespace flyball {

/// What is between a quantity and its reading; zeros make a perfect sensor.
struct SensorModel {
  double resolution = 0.0;  ///< Readings are whole multiples of it, in the quantity's unit.
  double noise = 0.0;       ///< Standard deviation of a fresh reading, in the quantity's unit.
  Time delay{};             ///< Age of what is read, s.
  Time refresh{};           ///< A fresh reading comes at multiples of it and is held between, s.
  Time moving_average{};    ///< The reading is the mean over this window, s.
};

/// A sensor in a simulation that records its truth at a fixed step.
class Sensor {
 public:
  /// @param model  What it does to the truth. @param step  s between the recorded truths.
  /// @errors ArgumentError::out_of_range, not_finite, not_positive.
  [[nodiscard]] static Expected<Sensor> create(const SensorModel& model, Time step, Random random);

  /// Tells the truth at the next step; the first call is time zero.
  void record(double truth);

  /// The reading at the last recorded time. Before the first recorded time the truth was constant.
  [[nodiscard]] double read();

 private:
  Sensor(const SensorModel& model, Time step, Random random)
      : model_(model), step_(step.si()), random_(random) {}

  [[nodiscard]] double truth_at(double time) const;
  [[nodiscard]] double mean(double from, double to) const;

  SensorModel model_;
  double step_;
  Random random_;
  std::vector<double> truth_;
  std::vector<double> integral_;  ///< Trapezoidal integral of the truth up to each record.
  double reading_ = 0.0;
  long long reading_index_ = -1;
};

}  // namespace flyball
