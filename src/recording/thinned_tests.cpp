#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "recording/thinned_tests.hpp"

namespace flyball::recording {

namespace {

constexpr std::size_t most_stretches = 16;  // of a running test
constexpr std::size_t few_stretches = 8;    // of one that had more
constexpr double finest_row = 2.5e-3;       // s: a tenth of the delay of usual sensors
constexpr std::size_t looked_at = 64;       // samples that tell how fast a channel is
constexpr std::size_t rows_of_a_fit = 30'000;

/// Numbers that are spread as lots are. Source: Steele, Lea, Flood, "Fast splittable pseudorandom
/// number generators" (2014), the finalizer of SplitMix64.
std::uint64_t lot_of(std::uint64_t number) {
  number += 0x9E3779B97F4A7C15U;
  number = (number ^ (number >> 30U)) * 0xBF58476D1CE4E5B9U;
  number = (number ^ (number >> 27U)) * 0x94D049BB133111EBU;
  return number ^ (number >> 31U);
}

std::size_t rows_of(const ThinnedTests::Test& test) {
  std::map<std::uint32_t, std::size_t> rows;
  std::size_t most = 0;
  for (const auto& stretch : test.stretches) {
    for (const auto& sample : stretch.samples) {
      most = std::max(most, ++rows[sample.channel]);
    }
  }
  return most;
}

}  // namespace

void ThinnedTests::begin(int kind, double time) {
  end(time);
  running_ = Test{.kind = kind, .begin = time, .end = time, .stretches = {}, .whole = true};
  stretches_.clear();
  last_ = {};
  every_ = 1;
  latest_ = time;
  for (Channel& channel : channels_) {
    channel = {.role = channel.role};
  }
}

void ThinnedTests::end(double time) {
  if (!running_) {
    return;
  }
  for (std::size_t channel = 0; channel < channels_.size(); ++channel) {
    close(channel);
  }
  if (!last_.samples.empty()) {
    stretches_.push_back(std::move(last_));
  }
  Test test = *std::move(running_);
  running_.reset();
  test.end = time;
  test.whole = every_ == 1;
  if (!test.whole) {
    std::vector<Stretch> few;
    const std::size_t count = std::min(few_stretches, stretches_.size());
    for (std::size_t k = 0; k < count; ++k) {
      few.push_back(std::move(stretches_[k * (stretches_.size() - 1) / (count - 1)]));
    }
    stretches_ = std::move(few);
  }
  test.stretches = std::move(stretches_);
  stretches_.clear();
  last_ = {};
  if (test.stretches.empty() || test.end - test.begin < shortest_) {
    return;
  }
  const std::size_t order = seen_++;
  std::vector<Kept>& alike = kept_[test.kind];
  alike.push_back({lot_of(order), order, std::move(test)});
  if (alike.size() > most_) {
    alike.erase(std::max_element(alike.begin(), alike.end(),
                                 [](const Kept& a, const Kept& b) { return a.lot < b.lot; }));
  }
}

void ThinnedTests::take(std::size_t channel, double time, double value) {
  if (!running_) {
    return;
  }
  latest_ = std::max(latest_, time);
  Channel& of = channels_[channel];
  if (of.stride > 0) {
    put_together(channel, time, value);
    return;
  }
  of.waiting.push_back({time, value});
  if (of.waiting.size() < looked_at) {
    return;
  }
  const double period =
      (of.waiting.back()[0] - of.waiting.front()[0]) / static_cast<double>(looked_at - 1);
  of.stride = period > 0.0 ? static_cast<std::size_t>(std::clamp(
                                 std::floor(finest_row / period * (1.0 + 1e-9)), 1.0, 1e5))
                           : 1;
  const auto waiting = std::move(of.waiting);
  of.waiting.clear();
  for (const auto& [at, what] : waiting) {
    put_together(channel, at, what);
  }
}

void ThinnedTests::put_together(std::size_t channel, double time, double value) {
  Channel& of = channels_[channel];
  if (of.stride == 1) {
    emit(channel, time, value);
    return;
  }
  if (of.values.empty()) {
    of.time = time;
  }
  of.values.push_back(value);
  if (of.values.size() < of.stride) {
    return;
  }
  double result = of.values.front();
  if (of.role != Role::point) {
    const std::size_t half = of.stride / 2;
    const bool held = of.role == Role::held;
    const auto end = of.values.begin() + static_cast<std::ptrdiff_t>(held ? of.stride : half + 1);
    double sum = std::accumulate(of.values.begin(), end, 0.0);
    auto count = static_cast<double>(end - of.values.begin());
    if (!held) {
      sum = std::accumulate(of.before.begin(), of.before.end(), sum);
      count += static_cast<double>(of.before.size());
      of.before.assign(of.values.end() - static_cast<std::ptrdiff_t>(half), of.values.end());
    }
    result = sum / count;
  }
  of.values.clear();
  emit(channel, of.time, result);
}

/// What waits for more is what there is.
void ThinnedTests::close(std::size_t channel) {
  Channel& of = channels_[channel];
  for (const auto& [time, value] : of.waiting) {
    emit(channel, time, value);
  }
  of.waiting.clear();
  of.values.clear();
}

void ThinnedTests::emit(std::size_t channel, double time, double value) {
  const double since = std::max(0.0, time - running_->begin);
  const auto index = static_cast<std::size_t>(std::min(since / stretch_length, 1e15));
  if (index > last_.index) {
    end_stretch();
    last_.index = index;
  }
  if (index == last_.index) {
    last_.samples.push_back({static_cast<std::uint32_t>(channel), time, value});
  } else if (!stretches_.empty() && stretches_.back().index == index) {
    stretches_.back().samples.push_back({static_cast<std::uint32_t>(channel), time, value});
  }
}

void ThinnedTests::end_stretch() {
  if (last_.index % every_ == 0 && !last_.samples.empty()) {
    stretches_.push_back(std::move(last_));
  }
  last_ = {};
  if (stretches_.size() > most_stretches) {
    every_ *= 2;
    std::erase_if(stretches_, [&](const Stretch& stretch) { return stretch.index % every_ != 0; });
  }
}

void ThinnedTests::clear() {
  running_.reset();
  kept_.clear();
  stretches_.clear();
  last_ = {};
  seen_ = 0;
}

std::vector<ThinnedTests::Test> ThinnedTests::finish() {
  end(std::nextafter(latest_ + 1e-6, latest_ + 1.0));
  std::size_t rows = 0;
  for (const auto& [kind, alike] : kept_) {
    for (const Kept& kept : alike) {
      rows += rows_of(kept.test);
    }
  }
  while (rows > rows_of_a_fit) {
    const auto most = std::max_element(
        kept_.begin(), kept_.end(),
        [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
    std::vector<Kept>& alike = most->second;
    if (alike.size() <= 1) {
      break;
    }
    const auto drawn = std::max_element(alike.begin(), alike.end(),
                                        [](const Kept& a, const Kept& b) { return a.lot < b.lot; });
    rows -= rows_of(drawn->test);
    alike.erase(drawn);
  }
  std::vector<Kept> all;
  for (auto& [kind, alike] : kept_) {
    all.insert(all.end(), std::make_move_iterator(alike.begin()),
               std::make_move_iterator(alike.end()));
  }
  kept_.clear();
  std::sort(all.begin(), all.end(), [](const Kept& a, const Kept& b) { return a.order < b.order; });
  std::vector<Test> tests;
  for (Kept& kept : all) {
    tests.push_back(std::move(kept.test));
  }
  return tests;
}

}  // namespace flyball::recording
