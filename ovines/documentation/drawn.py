"""Which function drew which picture of docs/figures; a test finds every function that gives a figure."""

from __future__ import annotations

#: module -> function -> a picture that it drew, below docs/figures
BY_MODULE = {
    "analysis.accelerometers.figure": {
        "accelerations_figure": "accelerations.png",
    },
    "analysis.accelerometers.trigger_figure": {
        "trigger_figure": "trigger_signal.png",
    },
    "analysis.dynamics.design_figures": {
        "taken_figure": "design_energy.png",
        "response_figure": "design_response.png",
        "design_figure": "design_search.png",
    },
    "analysis.dynamics.orbit_figures": {
        "lyapunov_figure": "orbits_lyapunov.png",
        "section_figure": "orbits_section.png",
        "bifurcation_figure": "orbits_bifurcation.png",
        "branch_figure": "orbits_follow.png",
        "basins_figure": "orbits_basins.png",
    },
    "analysis.figures.calibration": {
        "view_errors": "gallery/bar_chart_of_the_reprojection_error_of_every_calibration_vie.svg",
        "lens_field": "lens_field.png",
        "reprojection": "gallery/reprojection_error_over_time_and_by_marker.svg",
    },
    "analysis.figures.calibration_maps": {
        "coverage_and_residuals": "gallery/points_of_all_views_over_each_image_with_their_residual_vect.svg",
        "image_uncertainty": "gallery/maps_of_each_image_uncertainty_of_the_lens_difference_of_two.svg",
        "plane_uncertainty": "gallery/three_maps_of_the_sliding_plane_standard_deviation_of_x_y_an.svg",
        "scene": "gallery/cameras_and_boards_in_space.png",
        "pictures": "gallery/small_pictures_of_the_views_of_one_camera.png",
    },
    "analysis.figures.compare": {
        "flights_ahead": "gallery/error_of_each_flight_over_time_and_against_its_length.svg",
        "impacts_ahead": "gallery/simulated_against_measured_values_after_each_impact.svg",
        "run_distributions": "gallery/distributions_of_impact_rate_speed_energy_and_azimuth.svg",
    },
    "analysis.figures.geometry": {
        "wall_comparison": "gallery/contact_radius_and_wall_centre_from_markers_image_edges_and_.svg",
    },
    "analysis.figures.impacts": {
        "impact_detection": "gallery/acceleration_norm_and_nes_coordinates_with_detected_impacts.svg",
        "restitution_by_both": "gallery/restitution_of_each_impact_by_both_methods.svg",
    },
    "analysis.figures.law_map": {
        "error_maps": "gallery/maps_of_the_joint_likelihood_and_of_the_thesis_relative_erro.png",
        "regimes": "gallery/effective_tangential_restitution_against_incidence.svg",
    },
    "analysis.figures.markers": {
        "tracks_over_frame": "gallery/marker_paths_in_the_image_of_each_camera.png",
        "coordinates": "gallery/x_y_and_z_of_every_marker_over_time.svg",
        "host_distances": "gallery/distances_between_pairs_of_host_markers_over_time.svg",
        "circle_centres": "gallery/distances_between_circle_centres_over_time_and_circle_radii.svg",
    },
    "analysis.figures.part_one": {
        "drops": "drops.png",
        "spinning_drops": "spinning_drops.png",
        "extreme_speeds": "extreme_speeds.png",
        "near_wall": "near_wall.png",
        "stops": "stops.png",
        "farkas_functions": "farkas_functions.png",
        "sprung_host": "sprung_host.png",
        "shaken_host": "shaken_host.png",
        "perspectives": "perspectives.png",
    },
    "analysis.figures.series": {
        "parameter_trends": "gallery/identified_parameters_over_the_tests_of_the_series.svg",
    },
    "analysis.figures.trajectory": {
        "relative_trajectory": "gallery/trajectory_of_the_nes_relative_to_the_host_inside_the_wall.svg",
        "angle_and_spin": "gallery/angle_and_spin_of_the_nes_over_time.svg",
        "velocities": "gallery/velocity_components_of_nes_and_host_over_time.svg",
    },
    "analysis.gap.page.figures.at_blows": {
        "blow_figure": "gallery/places_at_blows_over_the_time_from_the_blow_and_the_law.svg",
    },
    "analysis.gap.page.figures.changed_picture": {
        "changed_picture_figure": "gallery/arrows_over_the_picture_of_a_camera_the_learnt_field_and_the.svg",
        "boards_figure": "gallery/arrows_over_the_world_about_the_host_what_the_boards_add_to_.svg",
    },
    "analysis.gap.page.figures.drive": {
        "drive_figure": "gallery/the_host_beside_its_drive.svg",
    },
    "analysis.gap.page.figures.impacts": {
        "law_figure": "gallery/measured_impacts_and_the_contact_law.svg",
    },
    "analysis.gap.page.figures.measured": {
        "measured_figure": "gallery/residuals_of_the_measurement.svg",
        "layout_figure": "gallery/markers_against_their_layout.svg",
        "ground_figure": "gallery/motion_of_the_ground_markers_over_time.svg",
    },
    "analysis.gap.page.figures.panels": {
        "ladder_figure": "gallery/bars_of_prediction_error_at_each_step_of_the_ladder.svg",
        "ranking_figure": "gallery/ranking_of_flight_candidates.svg",
        "residual_panels": "gallery/residuals_of_the_impacts.svg",
    },
    "analysis.gap.page.figures.paths": {
        "where_map": "gallery/map_of_the_residual.png",
        "flights_figure": "gallery/error_of_every_flight_with_and_without_the_effect.svg",
        "trajectory": "gallery/measured_and_re_simulated_trajectory.svg",
    },
    "analysis.gap.page.figures.rigid": {
        "rigid_figure": "gallery/markers_against_their_bodies.svg",
    },
    "analysis.gap.page.next_test": {
        "settings_figure": "gallery/bars_of_the_separation_by_setting_of_the_drive.svg",
    },
    "analysis.gap.page.laws": {
        "formula_figure": "gallery/acceleration_44_19_1_s_2_distance_in_room_exp_distance_in_ro.svg",
        "evidence_figure": "gallery/missing_quantity_over_its_covariate_before_and_after_the_law.svg",
        "path_figure": "gallery/residual_of_one_flight_over_time_without_and_with_the_law.svg",
    },
    "analysis.plan.page": {
        "settings_figure": "gallery/gain_of_each_changed_setting_for_each_of_the_four_main_param.svg",
    },
    "analysis.simulations.energy_figure": {
        "energies": "gallery/run_energies.png",
    },
    "analysis.simulations.floor_figure": {
        "floor_friction": "gallery/run_floor_friction.png",
    },
    "analysis.simulations.impact_figures": {
        "impacts": "gallery/run_impacts.png",
        "rebound_heights": "gallery/run_rebound_heights.png",
    },
    "analysis.simulations.motion_figures": {
        "paths": "gallery/run_paths.png",
        "coordinates": "gallery/run_coordinates.png",
        "velocities": "gallery/run_velocities.png",
    },
    "analysis.simulations.shaker_figure": {
        "shaker_figure": "shaker.png",
    },
    "analysis.simulations.sweep_figure": {
        "sweep_figure": "sweep_map.png",
    },
}
#: the same by the function's whole name
DRAWN = {f"{module}.{name}": picture for module, drawn in BY_MODULE.items() for name, picture in drawn.items()}
