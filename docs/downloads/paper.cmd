! CMD Version:2
! Written by walkerlab 0.3.0.dev0.
! Config: paper. Slope: 0.0174 rad, as tilted gravity.
! walkerlab's contact model from this start: walked, 10 steps.
! Its last step: 0.7110229 s, 0.3608206 m.
! Touches (s): 0.7107174, 1.431657, 2.148981, 2.860841, 3.570681, 4.280776, 4.991577, 5.702715
! Touches (s): 6.413842, 7.124865
! Left out: the end of a walk when a foot hits a pad from the side; here the pad pushes the foot away
! Left out: detection of falls, slides and steps, and the energy balance
defaults units  &
   length = mm  &
   angle = rad  &
   force = newton  &
   mass = kg  &
   time = sec
defaults units  &
   coordinate_system_type = cartesian  &
   orientation_type = body313
model create  &
   model_name = paper
defaults coordinate_system  &
   default_coordinate_system = .paper.ground
marker create  &
   marker_name = .paper.ground.origin  &
   location = 0, 0, 0  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_1  &
   location = -928.5756757222267, -50, -52.00000000000001  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_2  &
   location = -557.145405433336, -50, 9.999999999999998  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_3  &
   location = -185.71513514444536, -50, -52.00000000000001  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_4  &
   location = 185.71513514444536, -50, 9.999999999999998  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_5  &
   location = 557.145405433336, -50, -52.00000000000001  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_6  &
   location = 928.5756757222266, -50, 9.999999999999998  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_7  &
   location = 1300.0059460111174, -50, -52.00000000000001  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_8  &
   location = 1671.4362163000083, -50, 9.999999999999998  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_9  &
   location = 2042.8664865888986, -50, -52.00000000000001  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_10  &
   location = 2414.2967568777894, -50, 9.999999999999998  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_11  &
   location = 2785.7270271666803, -50, -52.00000000000001  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_12  &
   location = 3157.1572974555706, -50, 9.999999999999998  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_13  &
   location = 3528.5875677444615, -50, -52.00000000000001  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_14  &
   location = 3900.0178380333527, -50, 9.999999999999998  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_15  &
   location = 4271.448108322243, -50, -52.00000000000001  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_16  &
   location = 4642.878378611134, -50, 9.999999999999998  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.ground.pad_17  &
   location = 5014.308648900025, -50, -52.00000000000001  &
   orientation = (0(rad)), (0(rad)), (0(rad))
part create rigid_body name_and_position  &
   part_name = .paper.leg_2  &
   adams_id = 2  &
   location = -185.52942000930608, 982.6210237719089, 0  &
   orientation = (0.18679960850335692(rad)), (0(rad)), (0(rad))
defaults coordinate_system  &
   default_coordinate_system = .paper.leg_2
marker create  &
   marker_name = .paper.leg_2.cm  &
   location = 0, -166.66666666666666, 0  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.leg_2.hinge  &
   location = 0, 0, 0  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.leg_2.hinge_of_leg_1  &
   location = 0, 0, 0  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.leg_2.foot  &
   location = 0, -999, 0  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.leg_2.ball  &
   location = 0, -999, -31  &
   orientation = (0(rad)), (0(rad)), (0(rad))
part create rigid_body mass_properties  &
   part_name = .paper.leg_2  &
   mass = 15  &
   center_of_mass_marker = .paper.leg_2.cm  &
   ixx = 833333.3333333335  &
   iyy = 833333.3333333335  &
   izz = 833333.3333333335  &
   ixy = 0  &
   izx = 0  &
   iyz = 0
part create rigid_body initial_velocity  &
   part_name = .paper.leg_2  &
   vx = 705.0664246478832  &
   vy = 133.09700310364582  &
   vz = 0  &
   wx = 0  &
   wy = 0  &
   wz = (-0.86104071998445(rad/sec))
part create rigid_body name_and_position  &
   part_name = .paper.leg_1  &
   adams_id = 3  &
   location = -185.52942000930608, 982.6210237719089, 0  &
   orientation = (-0.18679960850335697(rad)), (0(rad)), (0(rad))
defaults coordinate_system  &
   default_coordinate_system = .paper.leg_1
marker create  &
   marker_name = .paper.leg_1.cm  &
   location = 0, -500, 0  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.leg_1.hinge  &
   location = 0, 0, 0  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.leg_1.foot  &
   location = 0, -999, 0  &
   orientation = (0(rad)), (0(rad)), (0(rad))
marker create  &
   marker_name = .paper.leg_1.ball  &
   location = 0, -999, 31  &
   orientation = (0(rad)), (0(rad)), (0(rad))
part create rigid_body mass_properties  &
   part_name = .paper.leg_1  &
   mass = 5  &
   center_of_mass_marker = .paper.leg_1.cm  &
   ixx = 1.25e-07  &
   iyy = 1.25e-07  &
   izz = 1.25e-07  &
   ixy = 0  &
   izx = 0  &
   iyz = 0
part create rigid_body initial_velocity  &
   part_name = .paper.leg_1  &
   vx = 548.436740233543  &
   vy = 216.0032641259773  &
   vz = 0  &
   wx = 0  &
   wy = 0  &
   wz = (-0.6058190001489273(rad/sec))
geometry create shape ellipsoid  &
   ellipsoid_name = .paper.leg_1.ball_1  &
   center_marker = .paper.leg_1.ball  &
   x_scale_factor = 2  &
   y_scale_factor = 2  &
   z_scale_factor = 2
geometry create shape ellipsoid  &
   ellipsoid_name = .paper.leg_2.ball_2  &
   center_marker = .paper.leg_2.ball  &
   x_scale_factor = 2  &
   y_scale_factor = 2  &
   z_scale_factor = 2
geometry create shape block  &
   block_name = .paper.ground.pad_1  &
   corner_marker = .paper.ground.pad_1  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_2  &
   corner_marker = .paper.ground.pad_2  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_3  &
   corner_marker = .paper.ground.pad_3  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_4  &
   corner_marker = .paper.ground.pad_4  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_5  &
   corner_marker = .paper.ground.pad_5  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_6  &
   corner_marker = .paper.ground.pad_6  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_7  &
   corner_marker = .paper.ground.pad_7  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_8  &
   corner_marker = .paper.ground.pad_8  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_9  &
   corner_marker = .paper.ground.pad_9  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_10  &
   corner_marker = .paper.ground.pad_10  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_11  &
   corner_marker = .paper.ground.pad_11  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_12  &
   corner_marker = .paper.ground.pad_12  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_13  &
   corner_marker = .paper.ground.pad_13  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_14  &
   corner_marker = .paper.ground.pad_14  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_15  &
   corner_marker = .paper.ground.pad_15  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_16  &
   corner_marker = .paper.ground.pad_16  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create shape block  &
   block_name = .paper.ground.pad_17  &
   corner_marker = .paper.ground.pad_17  &
   diag_corner_coords = 371.4302702888907, 50, 42
geometry create curve outline  &
   outline_name = .paper.leg_1.line_1  &
   marker_name = .paper.leg_1.hinge, .paper.leg_1.foot
geometry create curve outline  &
   outline_name = .paper.leg_2.line_2  &
   marker_name = .paper.leg_2.hinge, .paper.leg_2.foot
constraint create joint planar  &
   joint_name = .paper.plane_of_walk  &
   i_marker_name = .paper.leg_2.hinge  &
   j_marker_name = .paper.ground.origin
constraint create joint revolute  &
   joint_name = .paper.hinge_of_leg_1  &
   i_marker_name = .paper.leg_1.hinge  &
   j_marker_name = .paper.leg_2.hinge_of_leg_1
contact create  &
   contact_name = .paper.contact_1  &
   type = solid_to_solid  &
   i_geometry_name = .paper.leg_1.ball_1  &
   j_geometry_name = .paper.ground.pad_2, .paper.ground.pad_4, .paper.ground.pad_6, .paper.ground.pad_8, .paper.ground.pad_10, .paper.ground.pad_12, .paper.ground.pad_14, .paper.ground.pad_16  &
   stiffness = 100000  &
   damping = 90  &
   dmax = 0.1  &
   exponent = 2.2  &
   coulomb_friction = on  &
   mu_static = 0.9  &
   mu_dynamic = 0.7  &
   stiction_transition_velocity = 100  &
   friction_transition_velocity = 1000
contact create  &
   contact_name = .paper.contact_2  &
   type = solid_to_solid  &
   i_geometry_name = .paper.leg_2.ball_2  &
   j_geometry_name = .paper.ground.pad_1, .paper.ground.pad_3, .paper.ground.pad_5, .paper.ground.pad_7, .paper.ground.pad_9, .paper.ground.pad_11, .paper.ground.pad_13, .paper.ground.pad_15, .paper.ground.pad_17  &
   stiffness = 100000  &
   damping = 90  &
   dmax = 0.1  &
   exponent = 2.2  &
   coulomb_friction = on  &
   mu_static = 0.9  &
   mu_dynamic = 0.7  &
   stiction_transition_velocity = 100  &
   friction_transition_velocity = 1000
force create body gravitational  &
   gravity_field_name = .paper.gravity  &
   x_component_gravity = 170.68538691114597  &
   y_component_gravity = -9808.514999667126  &
   z_component_gravity = 0
output_control create request  &
   request_name = .paper.request_leg_1  &
   results_name = "leg_1"  &
   component_names = "angle", "velocity", "foot_along", "foot_height", "normal_force", "friction_force", "penetration", "slip_velocity"  &
   f1 = "AZ(.paper.leg_1.hinge,.paper.ground.origin)-0.017399999999999999"  &
   f2 = "WZ(.paper.leg_1.hinge,.paper.ground.origin)"  &
   f3 = "DX(.paper.leg_1.foot,.paper.ground.origin,.paper.ground.origin)"  &
   f4 = "DY(.paper.leg_1.foot,.paper.ground.origin,.paper.ground.origin)-1"  &
   f5 = "CONTACT(.paper.contact_1,0,3,0)"  &
   f6 = "CONTACT(.paper.contact_1,0,2,0)"  &
   f7 = "IF(-COS(PI*DX(.paper.leg_1.foot,.paper.ground.origin,.paper.ground.origin)/371.4302702888907):0,0,MAX(0,-(DY(.paper.leg_1.foot,.paper.ground.origin,.paper.ground.origin)-1)))"  &
   f8 = "VX(.paper.leg_1.foot,.paper.ground.origin,.paper.ground.origin,.paper.ground.origin)+1*WZ(.paper.leg_1.foot,.paper.ground.origin)"
output_control create request  &
   request_name = .paper.request_leg_2  &
   results_name = "leg_2"  &
   component_names = "angle", "velocity", "foot_along", "foot_height", "normal_force", "friction_force", "penetration", "slip_velocity"  &
   f1 = "AZ(.paper.leg_2.hinge,.paper.ground.origin)-0.017399999999999999"  &
   f2 = "WZ(.paper.leg_2.hinge,.paper.ground.origin)"  &
   f3 = "DX(.paper.leg_2.foot,.paper.ground.origin,.paper.ground.origin)"  &
   f4 = "DY(.paper.leg_2.foot,.paper.ground.origin,.paper.ground.origin)-1"  &
   f5 = "CONTACT(.paper.contact_2,0,3,0)"  &
   f6 = "CONTACT(.paper.contact_2,0,2,0)"  &
   f7 = "IF(COS(PI*DX(.paper.leg_2.foot,.paper.ground.origin,.paper.ground.origin)/371.4302702888907):0,0,MAX(0,-(DY(.paper.leg_2.foot,.paper.ground.origin,.paper.ground.origin)-1)))"  &
   f8 = "VX(.paper.leg_2.foot,.paper.ground.origin,.paper.ground.origin,.paper.ground.origin)+1*WZ(.paper.leg_2.foot,.paper.ground.origin)"
output_control create request  &
   request_name = .paper.request_walker  &
   results_name = "walker"  &
   component_names = "hip_along", "hip_height"  &
   f1 = "DX(.paper.leg_2.hinge)"  &
   f2 = "DY(.paper.leg_2.hinge)"
simulation script create  &
   sim_script_name = .paper.walk  &
   solver_commands = "simulate/dynamic, end = 7.124865219125031, dtout = 0.001"
