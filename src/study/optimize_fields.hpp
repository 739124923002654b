#pragma once

#include <array>

#include <flyball/study/optimize_section.hpp>

#include "study/field.hpp"

/// The keys of [optimize].
namespace flyball::study {

inline constexpr std::array optimize_fields{
    names(
        "waypoints", at<&OptimizeSection::waypoints>(),
        "[\"1 m, 1 m, 0 deg\", \"3 m, 2 m\", \"5 m, 1 m, 90 deg\"]",
        "Places to pass, x, y and where it matters the heading; \"stop\" behind them stops there, "
        "\"guess\" makes of one a hint of the way, \"moving\" lets the first or last be passed at "
        "speed")
        .no_option()
        .without("needed"),
    names("keep_out", at<&OptimizeSection::keep_out>(), "[\"3 m, 1.5 m, 0.5 m\"]",
          "Discs x, y, radius, or convex polygons x, y of each corner, that no part of the bumpers "
          "touches")
        .no_option(),
    names("keep_in", at<&OptimizeSection::keep_in>(), "[\"0 m, 0 m, 16.54 m, 8.21 m\"]",
          "Rectangles x, y, width, height, discs x, y, radius, or convex polygons that hold all of "
          "the bumpers")
        .no_option(),
    names("lanes", at<&OptimizeSection::lanes>(), "[\"0, 1, 5 cm\"]",
          "Waypoints from, to (counted from 0) and how far from the straight line between them the "
          "middle may be")
        .no_option(),
    names("point_at", at<&OptimizeSection::point_at>(), "[\"1, 2, 0 m, 5.5 m, 2 deg\"]",
          "Waypoints from, to between which the front looks at x, y, within an angle")
        .no_option(),
    quantity("max_velocity", at<&OptimizeSection::max_velocity>(), Dimension::velocity,
             Range::positive, "\"3 m/s\"", "Of the robot's middle, all along")
        .called("fastest-velocity")
        .without("what the motors give"),
    quantity("max_acceleration", at<&OptimizeSection::max_acceleration>(), Dimension::acceleration,
             Range::positive, "\"4 m/s^2\"", "Of the robot's middle, all along")
        .called("fastest-acceleration")
        .without("what motors and wheels give"),
    quantity("max_angular_velocity", at<&OptimizeSection::max_angular_velocity>(),
             Dimension::angular_velocity, Range::positive, "\"360 deg/s\"", "All along")
        .called("fastest-turn")
        .without("what motors and wheels give"),
    quantity("interval", at<&OptimizeSection::interval>(), Dimension::time, Range::positive,
             "\"40 ms\"", "About how long forces are held"),
    whole("attempts", at<&OptimizeSection::attempts>(), 1, 100, "4",
          "Starts that are tried: sides of obstacles, ways round"),
    quantity("longest", at<&OptimizeSection::longest>(), Dimension::time, Range::positive,
             "\"120 s\"", "That the way from a waypoint to the next may take"),
    quantity("time_limit", at<&OptimizeSection::time_limit>(), Dimension::time, Range::positive,
             "\"60 s\"", "Of the search: what was found until then is answered")};

}  // namespace flyball::study
