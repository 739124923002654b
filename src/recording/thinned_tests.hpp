#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

/// A bounded part of tests that are longer, or more, than can be held.
namespace flyball::recording {

/// What is kept of a long test in one piece (s).
constexpr double stretch_length = 2.0;

/// Keeps of the samples of tests, as they come, what a fit needs: of each class of tests a few
/// whole ones; of a test that is longer than 32 s stretches of 2 s that are spread evenly from its
/// beginning to its end; of samples that come faster than one every 2.5 ms those at that distance.
/// Memory hangs on the number of channels alone.
class ThinnedTests {
 public:
  /// What one sample in place of several has for a value.
  enum class Role {
    held,   ///< Their mean, the value until the next (a voltage).
    mean,   ///< The mean of those about it (a velocity).
    point,  ///< Its own (a position).
  };
  struct Sample {
    std::uint32_t channel = 0;
    double time = 0.0;
    double value = 0.0;
  };
  struct Stretch {
    std::size_t index = 0;  ///< Which 2 s of the test.
    std::vector<Sample> samples{};
  };
  struct Test {
    int kind = 0;
    double begin = 0.0;
    double end = 0.0;
    std::vector<Stretch> stretches{};  ///< The first begins with the test.
    bool whole = true;                 ///< Whether no stretch was left out.
  };

  /// @param most  Of one kind. @param shortest  s; shorter ones are none.
  ThinnedTests(std::size_t most, double shortest) : most_(most), shortest_(shortest) {}

  /// A further channel; they count from 0.
  void add_channel(Role role) { channels_.push_back({.role = role}); }

  /// A test begins; one that runs ends before.
  void begin(int kind, double time);
  void end(double time);
  [[nodiscard]] bool running() const { return running_.has_value(); }
  /// Of the test that runs; outside of tests nothing is kept.
  void take(std::size_t channel, double time, double value);

  /// Forgets all tests.
  void clear();
  /// How many tests there were.
  [[nodiscard]] std::size_t seen() const { return seen_; }
  /// What is kept, in the order in which it came; no channel has more than a fit's rows as long as
  /// there are several tests of a kind to choose from. The test that runs ends at its last sample.
  [[nodiscard]] std::vector<Test> finish();

 private:
  struct Channel {
    Role role = Role::point;
    std::size_t stride = 0;  ///< 0 until it is known.
    std::vector<std::array<double, 2>> waiting{};
    double time = 0.0;  ///< Of the first sample that is put together.
    std::vector<double> values{};
    std::vector<double> before{};  ///< The last of the values before.
  };
  struct Kept {
    std::uint64_t lot = 0;  ///< Which are kept of too many is drawn by it.
    std::size_t order = 0;
    Test test{};
  };

  void put_together(std::size_t channel, double time, double value);
  void close(std::size_t channel);
  void emit(std::size_t channel, double time, double value);
  void end_stretch();

  std::size_t most_;
  double shortest_;
  std::vector<Channel> channels_{};
  std::optional<Test> running_{};
  std::vector<Stretch> stretches_{};  ///< Of the running test, without the last.
  Stretch last_{};
  std::size_t every_ = 1;  ///< Which stretches are kept.
  double latest_ = 0.0;
  std::size_t seen_ = 0;
  std::map<int, std::vector<Kept>> kept_{};
};

}  // namespace flyball::recording
