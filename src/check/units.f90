! SPDX-License-Identifier: MIT
!> What cannot be in the units of a model and is not in its options: the extent of the geometry,
!> a gravity that is too large for it, and the values of an
!> analysis file that a labelled file names.
module rockdda_check_units
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_options, only : run_options_type
   use rockdda_model_possible_values, only : known_values_type, centrifuge
   use rockdda_model_units, only : unit_system_type, unit_system
   implicit none
   private
   public :: check_units

   !> Largest extent of a model: specimens of a laboratory to a mountain range [m].
   real(wp), parameter :: possible_extent(2) = [1.0e-4_wp, 2.0e5_wp]
   !> The largest models in a centrifuge [m].
   real(wp), parameter :: box_of_centrifuge = 3.0_wp

contains

   !> Report what cannot be.
   subroutine check_units(blocks, parameters, options, analysis_file, options_file, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(run_options_type), intent(in) :: options
      character(len=*), intent(in) :: analysis_file, options_file   !! for messages
      type(diagnostics_type), intent(inout) :: messages
      call check_extent(blocks, parameters, options%geometry_origin, options_file, messages)
      call check_gravity(blocks, parameters, options%gravity_origin, messages)
      if (len(analysis_file) > 0) call check_analysis(parameters, analysis_file, messages)
   end subroutine check_units

   !> A model of this extent is drawn in another unit of length.
   subroutine check_extent(blocks, parameters, geometry_origin, options_file, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(origin_type), intent(in) :: geometry_origin
      character(len=*), intent(in) :: options_file
      type(diagnostics_type), intent(inout) :: messages
      type(unit_system_type) :: system
      type(origin_type) :: origin
      real(wp) :: extent
      system = unit_system(parameters%units)
      extent = maxval(maxval(blocks%vertices, dim=2) - minval(blocks%vertices, dim=2))
      if (.not. system%is_known()) return
      if (system%in_si(extent, 'length') >= possible_extent(1) .and. &
          system%in_si(extent, 'length') <= possible_extent(2)) return
      origin = geometry_origin
      if (origin%line == 0) origin%file = options_file
      call messages%add(severity%error, 'the model is '//to_string(extent, 6)//' '//system%unit_of('length')// &
         ' wide or high (units = '''//trim(system%name)//'''), which cannot be: possible are 0.1 mm to 200 km. Is '// &
         "the geometry drawn in another unit of length? (units = 'none' of &model takes any)", origin)
   end subroutine check_extent

   !> A model larger than a box of a centrifuge with more than the earth's gravity.
   subroutine check_gravity(blocks, parameters, origin, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(origin_type), intent(in) :: origin                       !! where it was read; empty: it was not
      type(diagnostics_type), intent(inout) :: messages
      type(unit_system_type) :: system
      real(wp) :: gravity, extent                                   !! [m/s2], [m]
      system = unit_system(parameters%units)
      if (.not. system%is_known() .or. origin%line == 0) return
      gravity = system%in_si(parameters%acceleration_of_gravity(), 'length/time^2')
      extent = system%in_si(maxval(maxval(blocks%vertices, dim=2) - minval(blocks%vertices, dim=2)), 'length')
      if (gravity <= centrifuge .or. extent <= box_of_centrifuge) return
      call messages%add(severity%warning, 'gravity = '// &
         parameters%shown(parameters%acceleration_of_gravity(), 'length/time^2')//' is '// &
         to_string(gravity/9.81_wp, 3)//' times that of the earth, as models have in a centrifuge, '// &
         'which are not '//to_string(extent, 3)//' m wide or high: is it in another unit?', origin)
   end subroutine check_gravity

   !> Values of an analysis file that a labelled file names: those of the options were judged where they were read.
   subroutine check_analysis(parameters, analysis_file, messages)
      type(parameters_type), intent(in) :: parameters
      character(len=*), intent(in) :: analysis_file
      type(diagnostics_type), intent(inout) :: messages
      type(known_values_type) :: known
      type(origin_type) :: origin
      integer :: i
      known%system = unit_system(parameters%units)
      origin%file = analysis_file
      do i = 1, size(parameters%block_materials)
         call known%begin_group()
         associate (m => parameters%block_materials(i))
            call judge('block_material', i, 'density', 'mass/length^2', m%density)
            call judge('block_material', i, 'young', 'stress', m%youngs_modulus)
            call judge('block_material', i, 'unit_weight', 'force/length^2', m%weight)
            call judge('block_material', i, 'stress', 'stress', maxval(abs(m%stress)))
            call judge('block_material', i, 'stress_gradient', 'stress/length', maxval(abs(m%stress_gradient)))
            call judge('block_material', i, 'velocity', 'length/time', maxval(abs(m%velocity(1:2))))
         end associate
      end do
      do i = 1, size(parameters%joint_materials)
         associate (m => parameters%joint_materials(i))
            call judge('joint_material', i, 'friction', 'deg', m%friction_angle)
            call judge('joint_material', i, 'cohesion', 'stress', m%cohesion)
            call judge('joint_material', i, 'tension', 'stress', m%tension)
         end associate
      end do

   contains

      !> One value.
      subroutine judge(group, number, name, dimension, value)
         character(len=*), intent(in) :: group, name, dimension
         integer, intent(in) :: number
         real(wp), intent(in) :: value
         character(len=:), allocatable :: problem
         logical :: unlikely
         call known%problem_of(group, name, dimension, value, .false., problem, unlikely)
         if (len(problem) > 0) call messages%add(severity%error, group//' '//to_string(number)//': '//name//': '// &
                                                 problem, origin)
      end subroutine judge

   end subroutine check_analysis

end module rockdda_check_units
