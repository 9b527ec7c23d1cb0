! SPDX-License-Identifier: MIT
!> Loads of the options before a run: loading points that the geometry does not have, and names.
module rockdda_run_loads
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_cutting_assignment, only : add_loading_points
   use rockdda_cutting_location, only : block_locator_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : run_options_type
   implicit none
   private
   public :: place_loads, check_load_names

contains

   !> Add the points of &loading_point at to the model. A group then has the numbers of its points; one that names none
   !> has all of the geometry.
   subroutine place_loads(options, blocks, messages)
      type(run_options_type), intent(inout) :: options
      type(block_system_type), intent(inout) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      type(block_locator_type) :: locator
      integer :: i, k, before, given
      given = blocks%loading%n
      if (.not. any([(allocated(options%loading_points(i)%at), i=1, size(options%loading_points))])) return
      call locator%init(blocks, blocks%edge_node_distance)
      do i = 1, size(options%loading_points)
         associate (group => options%loading_points(i))
            if (.not. allocated(group%at)) then
               if (.not. allocated(group%points)) group%points = [(k, k=1, given)]
               cycle
            end if
            if (allocated(group%points)) then
               call messages%add(severity%error, '&loading_point: give points or at, not both', group%origin)
               cycle
            end if
            before = blocks%loading%n
            call add_loading_points(group%at, group%origin, locator, blocks, messages)
            group%points = [(k, k=before + 1, blocks%loading%n)]
         end associate
      end do
   end subroutine place_loads

   !> Names of loads are words that the command line can list.
   subroutine check_load_names(options, messages)
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      if (allocated(options%loading_points)) then
         do i = 1, size(options%loading_points)
            call check('loading_point', options%loading_points(i)%name, options%loading_points(i)%origin)
         end do
      end if
      if (allocated(options%line_loads)) then
         do i = 1, size(options%line_loads)
            call check('line_load', options%line_loads(i)%name, options%line_loads(i)%origin)
         end do
      end if
      if (allocated(options%boundaries)) then
         do i = 1, size(options%boundaries)
            call check('boundary', options%boundaries(i)%name, options%boundaries(i)%origin)
         end do
      end if

   contains

      !> One name.
      subroutine check(group, name, origin)
         character(len=*), intent(in) :: group
         character(len=:), allocatable, intent(in) :: name
         type(origin_type), intent(in) :: origin
         if (.not. allocated(name)) return
         if (scan(trim(name), ',=') > 0) call messages%add(severity%error, '&'//group// &
            ": the name of a load has neither a comma nor '=', found '"//trim(name)//"'", origin)
      end subroutine check

   end subroutine check_load_names

end module rockdda_run_loads
