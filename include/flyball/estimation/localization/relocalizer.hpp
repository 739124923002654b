#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include <flyball/geometry/se2.hpp>

namespace flyball {

/// Where a robot is, from the last landmarks that it saw and nothing else: for the start, for a
/// robot that was carried away, for a filter that has lost its way.
///
/// Two landmarks seen, brought into one frame by the odometry between them, tell the pose in closed
/// form; of all pairs the pose that most of the newest sightings agree with is taken.
///
/// Run-time object: noexcept, allocation-free, bounded: at most capacity³/2 distances.
/// Source: Fischler and Bolles, "Random sample consensus", Comm. ACM 24 (1981), with all pairs in
/// place of random ones; Arun, Huang, Blostein, "Least-squares fitting of two 3-D point sets"
/// (1987).
class Relocalizer {
 public:
  static constexpr int capacity = 24;

  /// A pose that the newest sightings agree with.
  struct Candidate {
    Pose2d pose;         ///< Of now.
    int agreeing = 0;    ///< Of the newest sightings, those within the tolerance,
    int considered = 0;  ///< of how many.
  };

  /// @param tolerance  m plus 5 % of the distance: by how much a landmark may be off.
  /// @param longest    s; older sightings are forgotten.
  explicit Relocalizer(double tolerance = 0.3, double longest = 20.0) noexcept
      : tolerance_(tolerance), longest_(longest) {}

  /// @param time  s. @param dead_reckoned  The pose by odometry alone, from anywhere.
  /// @param seen  The landmark in the robot's frame, m. @param landmark  Where it is.
  void add(double time, const Pose2d& dead_reckoned, const Eigen::Vector2d& seen,
           const Eigen::Vector2d& landmark) noexcept;
  void clear() noexcept { count_ = 0; }
  [[nodiscard]] int size() const noexcept { return count_; }
  /// s, of the newest sighting that was taken.
  [[nodiscard]] double newest_time() const noexcept { return newest(0).time; }

  /// The pose that explains the newest sightings, at least `least` of them and of two landmarks or
  /// more, two of them not of the landmark that was seen most; none if there is no such pose.
  /// @param dead_reckoned  Of now.
  [[nodiscard]] std::optional<Candidate> find(const Pose2d& dead_reckoned,
                                              int least = 4) const noexcept;
  /// How many of the newest `considered` sightings a pose of now agrees with.
  [[nodiscard]] int agreeing(const Pose2d& pose, const Pose2d& dead_reckoned,
                             int considered) const noexcept;

 private:
  struct Entry {
    double time;
    Pose2d dead_reckoned;
    Eigen::Vector2d seen;
    Eigen::Vector2d landmark;
  };

  [[nodiscard]] const Entry& newest(int back) const noexcept {
    return entries_[static_cast<std::size_t>((next_ - 1 - back + 2 * capacity) % capacity)];
  }

  std::array<Entry, capacity> entries_{};
  int next_ = 0;
  int count_ = 0;
  double tolerance_;
  double longest_;
};

}  // namespace flyball
