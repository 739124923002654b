#pragma once

#include <flyball/classical/frequency_response.hpp>
#include <flyball/classical/loop_margins.hpp>

namespace flyball::classical::detail {

/// How large a loop's functions get over all frequencies.
struct LoopPeaks {
  Peak sensitivity;    ///< max |1/(1 + L)|
  Peak complementary;  ///< max |L/(1 + L)|
  Peak spread;         ///< max |(1 - L)/(1 + L)|
};

/// To 1e-5 by bounds on what ln L moves between two frequencies, and refined.
/// @param response  L, whose factors are known. @errors As `frequency_grid`.
[[nodiscard]] Expected<LoopPeaks> loop_peaks(const FrequencyResponse& response);

/// Takes into account that L(jω) is near -1/factor for ever, as a direct path behind dead time is:
/// the gain margin is the factor if none is nearer to one.
void approach(double factor, LoopMargins& margins);

/// `loop_margins` of a response, and where the disk margin is found.
struct WholeMargins {
  LoopMargins margins;
  Peak spread;  ///< max |(1 - L)/(1 + L)|, stable or not.
};
[[nodiscard]] Expected<WholeMargins> whole_margins(const FrequencyResponse& loop);

/// Whether the closed loop is stable, by the loop's crossings of the unit circle: of the work
/// of its margins the part that does not grow with the dead time.
/// @errors As `loop_margins`.
[[nodiscard]] Expected<bool> keeps_stable(const TransferFunction& loop);

/// What the search for the crossings of one loop, or of all channels of one, may take, in
/// multiplications and divisions of complex numbers: 5e7 and 2e5 n² for a loop of n states.
class CrossingWork {
 public:
  explicit CrossingWork(Eigen::Index states)
      : left_(5e7 + 2e5 * static_cast<double>(states) * static_cast<double>(states)) {}

  bool spend(double work) noexcept {
    left_ -= work;
    return left_ >= 0.0;
  }

 private:
  double left_;
};
/// The same within what is left. @errors Also SystemError::no_convergence once that is done.
[[nodiscard]] Expected<WholeMargins> whole_margins(const FrequencyResponse& loop,
                                                   CrossingWork& work);

}  // namespace flyball::classical::detail
