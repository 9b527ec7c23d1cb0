! SPDX-License-Identifier: MIT
!> Groups and names of the options file.
module rockdda_io_option_names
   use rockdda_io_name_hints, only : name_length
   implicit none
   private
   public :: option_groups, names_of

   !> All groups; their names below in the same order.
   character(len=*), parameter :: option_groups(11) = [character(len=name_length) :: 'run', 'time', 'contact', &
      'solver', 'material', 'load', 'line_load', 'joint_law', 'block_damping', 'stage', 'output']
   character(len=*), parameter :: run_names(9) = [character(len=name_length) :: 'title', 'steps', 't_end', &
      'save_every', 'save_dt', 'threads', 'max_wall', 'checkpoint_every', 'strict']
   character(len=*), parameter :: time_names(8) = [character(len=name_length) :: 'dt_max', 'dt_min', 'k01', &
      'displacement_ratio', 'length_scale', 'rotation', 'cut_factor', 'max_open_close']
   character(len=*), parameter :: contact_names(8) = [character(len=name_length) :: 'stiffness', 'shear_ratio', &
      'search_factor', 'angle_tolerance', 'close_tolerance', 'open_tolerance', 'fixed_stiffness_factor', 'preset']
   character(len=*), parameter :: solver_names(4) = [character(len=name_length) :: 'method', 'tolerance', 'omega', &
      'preconditioner']
   character(len=*), parameter :: material_names(2) = [character(len=name_length) :: 'plane', 'mass']
   character(len=*), parameter :: load_names(3) = [character(len=name_length) :: 'gravity', 'base_acceleration', &
      'harmonic']
   character(len=*), parameter :: line_load_names(4) = [character(len=name_length) :: 'ends', 'force_start', &
      'force_end', 'table']
   character(len=*), parameter :: joint_law_names(4) = [character(len=name_length) :: 'material', 'law', &
      'parameters', 'damping_ratio']
   character(len=*), parameter :: block_damping_names(1) = [character(len=name_length) :: 'mass_proportional']
   character(len=*), parameter :: stage_names(5) = [character(len=name_length) :: 'until_step', 'until_time', 'k01', &
      'gravity', 'release']
   character(len=*), parameter :: output_names(3) = [character(len=name_length) :: 'file', 'frames', 'contacts']

contains

   !> Names of a group; none when the group is unknown.
   pure function names_of(group) result(names)
      character(len=*), intent(in) :: group
      character(len=name_length), allocatable :: names(:)
      select case (group)
      case ('run'); names = run_names
      case ('time'); names = time_names
      case ('contact'); names = contact_names
      case ('solver'); names = solver_names
      case ('material'); names = material_names
      case ('load'); names = load_names
      case ('line_load'); names = line_load_names
      case ('joint_law'); names = joint_law_names
      case ('block_damping'); names = block_damping_names
      case ('stage'); names = stage_names
      case ('output'); names = output_names
      case default; allocate (names(0))
      end select
   end function names_of

end module rockdda_io_option_names
