#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <vector>

#include <flyball/io/json_writer.hpp>

#include "report/plot_data.hpp"

namespace flyball::report {

namespace {

std::string_view name_of(LineStyle style) {
  switch (style) {
    case LineStyle::solid:
      return "solid";
    case LineStyle::dashed:
      return "dashed";
    case LineStyle::points:
      return "points";
    case LineStyle::steps:
      return "steps";
    case LineStyle::crosses:
      return "crosses";
    case LineStyle::circles:
      return "circles";
    case LineStyle::squares:
      return "squares";
    case LineStyle::frames:
      return "frames";
    case LineStyle::diamonds:
      return "diamonds";
    case LineStyle::dash_dot:
      return "dash_dot";
    case LineStyle::dotted:
      return "dotted";
    case LineStyle::samples:
      return "samples";
    case LineStyle::guide:
      return "guide";
  }
  return "solid";
}

void append_base64(std::string& text, const std::vector<unsigned char>& bytes) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  text.reserve(text.size() + (bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = (group << 8U) | (k < count ? bytes[i + k] : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? digits[(group >> (18U - 6U * k)) & 63U] : '=';
    }
  }
}

/// The columns of a figure, each once.
class Columns {
 public:
  std::size_t add(const std::vector<double>& values) {
    const auto same = std::find_if(columns_.begin(), columns_.end(), [&](const auto* column) {
      return column == &values || *column == values;
    });
    if (same == columns_.end()) {
      columns_.push_back(&values);
      return columns_.size() - 1;
    }
    return static_cast<std::size_t>(same - columns_.begin());
  }

  void write(JsonWriter& json) const {
    std::vector<unsigned char> bytes;
    json.list("columns", columns_, [&](const std::vector<double>* column) {
      const double base = base_of(*column);
      for (const double value : *column) {
        const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value - base));
        for (unsigned shift = 0; shift < 32; shift += 8) {
          bytes.push_back(static_cast<unsigned char>((bits >> shift) & 255U));
        }
      }
      json.open('[');
      json.write(column->size());
      json.write(base);
      json.close(']');
    });
    std::string text;
    append_base64(text, bytes);
    json.add("data", text);
  }

 private:
  /// The first value, where all lie closer to it than to zero: a clock that began long ago.
  static double base_of(const std::vector<double>& column) {
    const auto finite = [](double value) { return std::isfinite(value); };
    const auto first = std::find_if(column.begin(), column.end(), finite);
    if (first == column.end()) {
      return 0.0;
    }
    const bool far = std::all_of(first, column.end(), [&](double value) {
      return !std::isfinite(value) || std::abs(value - *first) < std::abs(*first);
    });
    return far ? *first : 0.0;
  }

  std::vector<const std::vector<double>*> columns_;
};

class PanelWriter {
 public:
  PanelWriter(JsonWriter& json, Columns& columns) : json_(json), columns_(columns) {}

  void write(const PlotPanel& panel) {
    int next = 0;  // As the still picture's: bands, then lines.
    const auto color = [&](int wanted) { return (wanted >= 0 ? wanted : next++) % 7; };
    json_.add("y", panel.y_label);
    json_.add("logY", panel.log_y);
    if (panel.y_limits) {
      json_.add("limits", std::vector{panel.y_limits->low, panel.y_limits->high});
    }
    json_.list("bands", panel.bands, [&](const PlotBand& band) {
      json_.object([&] {
        json_.add("label", band.label);
        json_.add("color", color(band.color));
        json_.add("x", columns_.add(band.x));
        json_.add("low", columns_.add(band.low));
        json_.add("high", columns_.add(band.high));
      });
    });
    json_.list("lines", panel.lines, [&](const PlotLine& line) {
      json_.object([&] {
        json_.add("label", line.label);
        json_.add("style", name_of(line.style));
        json_.add("color", line.style == LineStyle::guide ? 0 : color(line.color));
        json_.add("x", columns_.add(line.x));
        json_.add("y", columns_.add(line.y));
      });
    });
    json_.list("marks", panel.marks, [&](const PlotMark& mark) {
      json_.object([&] {
        json_.add("at", mark.at);
        json_.add("label", mark.label);
        json_.add("vertical", mark.vertical);
      });
    });
    json_.list("spans", panel.spans, [&](const PlotSpan& span) {
      json_.object([&] {
        json_.add({{"from", span.from}, {"to", span.to}});
        json_.add("label", span.label);
      });
    });
    json_.list("notes", panel.notes, [&](const PlotNote& note) {
      json_.object([&] {
        json_.add({{"x", note.x}, {"y", note.y}});
        json_.add("text", note.text);
      });
    });
    json_.list("ticks", panel.y_ticks, [&](const PlotTick& tick) {
      json_.object([&] {
        json_.add("at", tick.at);
        json_.add("label", tick.label);
      });
    });
  }

 private:
  JsonWriter& json_;
  Columns& columns_;
};

std::string_view name_of(PartStyle style) {
  switch (style) {
    case PartStyle::filled:
      return "filled";
    case PartStyle::outlined:
      return "outlined";
    case PartStyle::ground:
      break;
  }
  return "ground";
}

/// '<' stands in texts alone, and must not end the element.
std::string in_an_element(std::string_view json) {
  std::string text;
  for (const char c : json) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

}  // namespace

std::string plot_data(const Figure& figure) {
  const Plot& plot = figure.plot;
  Columns columns;
  JsonWriter json;
  json.object([&] {
    json.add("title", plot.title.empty() ? figure.title : plot.title);
    json.add("x", plot.x_label);
    json.add("logX", plot.log_x);
    json.add("equal", plot.equal_axes);
    json.add("circle", plot.unit_circle);
    json.add("clock", plot.clock);
    json.list("panels", plot.panels, [&](const PlotPanel& panel) {
      json.object([&] { PanelWriter(json, columns).write(panel); });
    });
    columns.write(json);
  });
  return in_an_element(json.text());
}

std::string animation_data(const Animation& animation) {
  Columns columns;
  JsonWriter json;
  const auto frame = [&](std::string_view key, const std::vector<double>& values) {
    if (!values.empty()) {
      json.add(key, columns.add(values));
    }
  };
  json.object([&] {
    json.add("title", animation.title);
    json.add("clock", animation.clock);
    json.add("time", columns.add(animation.time));
    json.list("parts", animation.parts, [&](const MovingPart& part) {
      json.object([&] {
        json.add("label", part.label);
        json.add("style", name_of(part.style));
        json.add("color", part.color % 7);
        json.add("x", columns.add(part.x));
        json.add("y", columns.add(part.y));
        frame("toX", part.to_x);
        frame("toY", part.to_y);
        frame("angle", part.angle);
      });
    });
    json.list("values", animation.values, [&](const TellingValue& value) {
      json.object([&] {
        json.add("label", value.label);
        json.add("unit", value.unit);
        json.add("values", columns.add(value.values));
      });
    });
    columns.write(json);
  });
  return in_an_element(json.text());
}

}  // namespace flyball::report
