#pragma once

#include <string_view>
#include <vector>

#include <flyball/io/plot.hpp>

#include "io/plot_data.hpp"

/// Where words stand in a panel; private to io.
namespace flyball::io {

/// What a panel shows, on how many pixels.
struct PanelView {
  Range x;
  Range y;
  bool log_x = false;
  bool log_y = false;
  double width = 0.0;
  double height = 0.0;
};

/// Places the labels of a panel's vertical marks where they hide little of its curves and nothing
/// of each other.
class Labels {
 public:
  Labels(const PlotPanel& panel, const PanelView& view);

  /// Where a label stands beside its mark.
  struct Placement {
    double height = 0.0;  ///< Of its middle, as a share of the panel's.
    bool before = false;  ///< Whether it ends at the mark in place of beginning there.
  };
  /// Where it hides the least; after its mark and at the top if that is nowhere.
  /// @param size  Of its font, pixels.
  [[nodiscard]] Placement place(const PlotMark& mark, double size);

 private:
  struct Place {
    double left = 0.0;
    double right = 0.0;
    double bottom = 0.0;
    double top = 0.0;
  };
  struct Curve {
    Points points;  ///< Pixels from the panel's lower left corner.
    bool scattered = false;
  };

  [[nodiscard]] static std::size_t hidden(const Curve& curve, const Place& place);

  PanelView view_;
  std::vector<Curve> curves_;
  std::vector<double> marks_;  ///< Pixels from the panel's left edge.
  std::vector<Place> taken_;
};

}  // namespace flyball::io
