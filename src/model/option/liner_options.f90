! SPDX-License-Identifier: MIT
!> Rows of the table of options for linings, &liner, and what is wrong with one.
module rockdda_model_liner_options
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : is_given
   use rockdda_model_options, only : liner_type, is_set
   use rockdda_model_option, only : option
   use rockdda_model_option_rows, only : option_rows_type
   implicit none
   private
   public :: describe_liners, liner_problem

contains

   !> &liner
   subroutine describe_liners(table, liners)
      type(option_rows_type), intent(inout) :: table
      type(liner_type), allocatable, intent(inout) :: liners(:)
      integer :: i
      call table%begin_list('liner', 'A lining of the rock along a line, or a layer on another lining.')
      if (.not. allocated(liners)) allocate (liners(table%n_wanted()))
      do i = 1, size(liners)
         call table%start_element(i, liners(i)%origin)
         call describe_liner(table, liners(i))
      end do
   end subroutine describe_liners

   !> One group.
   subroutine describe_liner(table, liner)
      type(option_rows_type), intent(inout) :: table
      type(liner_type), intent(inout) :: liner
      character(len=*), parameter :: needed = 'required'
      call table%add(option('name', 'name of the lining', default_text="'liner N'", not_blank=.true.), liner%name)
      call table%add(option('along', 'line of the rock that it covers, in which its axis lies; closed when it ends '// &
                            'where it begins', unit='length', columns='x, y', &
                            default_text='outline, or the line of the lining on which it lies'), liner%along)
      call table%add(option('outline', 'region whose outer line it follows', default_text='none', not_blank=.true.), &
                     liner%outline)
      call table%add(option('on', 'name of the lining on which this layer lies', default_text='none', &
                            not_blank=.true.), liner%on)
      call table%add(option('thickness', 'of the lining', unit='length', above=0.0_wp, default_text=needed), &
                     liner%thickness)
      call table%add(option('young', "Young's modulus", unit='stress', above=0.0_wp, default_text=needed), liner%young)
      call table%add(option('poisson', "Poisson's ratio", above=-1.0_wp, below=0.5_wp, default_text='0.2'), &
                     liner%poisson)
      call table%add(option('density', 'mass per area', unit='mass/length^2', above=0.0_wp, &
                            default_text='that of the first block material'), liner%density)
      call table%add(option('compressive_strength', 'at which it crushes', unit='stress', above=0.0_wp, &
                            default_text='none: it does not crush'), liner%compressive_strength)
      call table%add(option('tensile_strength', 'at which it cracks', unit='stress', least=0.0_wp, &
                            default_text='none: it does not crack'), liner%tensile_strength)
      call table%add(option('joint_material', 'between the lining and what it lies on: number or name', &
                            default_text='full bond', or_number=.true.), liner%joint_material)
      call table%add(option('element', 'largest distance of nodes', unit='length', above=0.0_wp, &
                            default_text='2 thickness, at least 24 nodes around a closed line'), liner%element)
   end subroutine describe_liner

   !> What is wrong with a lining by itself; empty: nothing.
   pure function liner_problem(liner) result(problem)
      type(liner_type), intent(in) :: liner
      character(len=:), allocatable :: problem
      problem = ''
      if (.not. is_set(liner%thickness)) then
         problem = 'thickness is missing'
      else if (.not. is_set(liner%young)) then
         problem = 'young is missing'
      else if (.not. (is_given(liner%on) .or. allocated(liner%along) .or. is_given(liner%outline))) then
         problem = 'along is missing, its line: give along = x1,y1, x2,y2, ... or outline = the name of a region'
      end if
   end function liner_problem

end module rockdda_model_liner_options
