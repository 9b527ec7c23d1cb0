! SPDX-License-Identifier: MIT
!> Hints for mistyped groups and names of namelist files.
!>
!> Words of the field for what the tables of options name otherwise.
module rockdda_io_name_hints
   use rockdda_model_option, only : name_length
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_base_strings, only : lower_case
   implicit none
   private
   public :: group_hint, name_hint, other_words, other_words_for

   integer, parameter :: few_names = 6      !! groups of up to this number of names are listed with them

   !> The names of an option, and other words for it, a blank before and behind each.
   type :: synonym_type
      character(len=20) :: name
      character(len=110) :: words
   end type synonym_type

   type(synonym_type), parameter :: synonyms(36) = [ &
      synonym_type('friction', ' phi fi angle friction_angle mu tan_phi frictionangle phi_b '), &
      synonym_type('cohesion', ' c coh cohesive_strength adhesion '), &
      synonym_type('tension', ' t ft sigma_t tensile_strength tensile tension_strength rt '), &
      synonym_type('dilation', ' psi dilatancy dilation_angle dilatancy_angle '), &
      synonym_type('normal_stiffness', ' kn k_n jkn stiffness normal '), &
      synonym_type('shear_stiffness', ' ks k_s kt jks stiffness shear '), &
      synonym_type('damping_ratio', ' damping xi zeta d '), &
      synonym_type('restitution', ' cor e_n coefficient_of_restitution '), &
      synonym_type('density', ' rho dens mass_density '), &
      synonym_type('unit_weight', ' gamma weight specific_weight gamma_w gammaw bulk_weight '), &
      synonym_type('young', ' e emod e_mod modulus youngs_modulus young_modulus elastic_modulus '), &
      synonym_type('poisson', ' nu v poissons_ratio poisson_ratio '), &
      synonym_type('gravity', ' g grav acceleration '), &
      synonym_type('stress', ' sigma s insitu_stress '), &
      synonym_type('k0', ' k lateral_pressure stress_ratio '), &
      synonym_type('number', ' id no nr mat index material material_number '), &
      synonym_type('name', ' label title '), &
      synonym_type('dt_max', ' dt timestep time_step step delta_t g1 '), &
      synonym_type('t_end', ' tend t_max tmax end_time duration time '), &
      synonym_type('steps', ' n nstep nsteps n_steps number_of_steps '), &
      synonym_type('displacement_ratio', ' g2 max_displacement displacement '), &
      synonym_type('stiffness', ' g0 penalty contact_stiffness k '), &
      synonym_type('excavate', ' remove excavation delete dig '), &
      synonym_type('place', ' add build construct fill '), &
      synonym_type('pressure', ' p q surcharge load '), &
      synonym_type('record', ' accelerogram earthquake file motion acceleration '), &
      synonym_type('polygon', ' points corners vertices shape '), &
      synonym_type('box', ' rectangle rect '), &
      synonym_type('table', ' water_table level surface points phreatic '), &
      synonym_type('water', ' pore_pressure groundwater ground_water seepage '), &
      synonym_type('boundary', ' boundaries support supports fixed fixity roller bc constraint '), &
      synonym_type('quake', ' earthquake seismic shaking '), &
      synonym_type('bolt', ' bolts anchor anchors rock_bolt rockbolt tie_rod cable '), &
      synonym_type('liner', ' lining linings liners shotcrete support shell beam '), &
      synonym_type('yield_force', ' strength yield capacity ultimate_force '), &
      synonym_type('in_situ', ' insitu initial_stress ground_stress ')]

contains

   !> The nearest group, as "; did you mean '&time'?", or where else what the name says stands.
   pure function group_hint(group, groups, geometry_words) result(text)
      character(len=*), intent(in) :: group
      character(len=*), intent(in) :: groups(:)     !! valid groups of the file
      character(len=*), intent(in), optional :: geometry_words(:)   !! what the geometry file holds
      character(len=:), allocatable :: text
      character(len=name_length + 1) :: known(size(groups))
      integer :: i
      if (present(geometry_words)) then
         if (any(geometry_words == group)) then
            text = '; lines and points stand in the geometry file'
            return
         end if
      end if
      do i = 1, size(groups)
         known(i) = '&'//groups(i)
      end do
      text = other_words(group, groups)
      if (len(text) > 0) return
      text = did_you_mean('&'//group, known)
   end function group_hint

   !> The other groups that have exactly this name, or else the nearest name of this group; the names of a group that
   !> has few.
   pure function name_hint(name, group, group_of, names) result(text)
      character(len=*), intent(in) :: name, group
      character(len=*), intent(in) :: names(:)      !! all that the file may have
      character(len=*), intent(in) :: group_of(:)   !! the group of each of them
      character(len=:), allocatable :: text
      integer :: i, n_own
      if (name == 'accuracy' .and. group == 'time') then
         text = '; steps are not chosen by their error: rockdda-post convergence shows what the step changes'
         return
      else if (group == 'opening' .and. (name == 'name' .or. name == 'region')) then
         text = "; draw it as &region of the options file, which stages name, and take its outline here: "// &
                "outline = 'NAME'"
         return
      end if
      text = ''
      do i = 1, size(names)
         if (names(i) /= name) cycle
         if (len(text) == 0) then
            text = '; it belongs to &'//trim(group_of(i))
         else if (index(text//' ', '&'//trim(group_of(i))//' ') == 0) then
            text = text//' and &'//trim(group_of(i))
         end if
      end do
      if (len(text) == 0) text = other_words(name, pack(names, group_of == group))
      if (len(text) == 0) text = did_you_mean(name, pack(names, group_of == group))
      n_own = count(group_of == group)
      if (index(text, 'did you mean') > 0 .or. n_own == 0 .or. n_own > few_names) return
      text = text//'; &'//group//' has '
      do i = 1, size(names)
         if (group_of(i) /= group) cycle
         text = text//trim(names(i))
         n_own = n_own - 1
         if (n_own > 0) text = text//', '
      end do
   end function name_hint

   !> "; did you mean 'friction'?" for other words of the field.
   pure function other_words(name, table) result(text)
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: table(:)      !! names that are known
      character(len=:), allocatable :: text
      character(len=20), allocatable :: usual(:)
      integer :: i
      text = ''
      call usual_names(name, table, usual)
      if (size(usual) == 0) return
      text = "; did you mean '"//trim(usual(1))//"'"
      do i = 2, size(usual)
         text = text//" or '"//trim(usual(i))//"'"
      end do
      text = text//'?'
   end function other_words

   !> Names that another word may mean, those in the table only.
   pure subroutine usual_names(word, table, names)
      character(len=*), intent(in) :: word, table(:)
      character(len=20), allocatable, intent(out) :: names(:)
      logical :: fits(size(synonyms))
      integer :: i
      do i = 1, size(synonyms)
         fits(i) = index(synonyms(i)%words, ' '//trim(lower_case(word))//' ') > 0 .and. any(table == synonyms(i)%name)
      end do
      names = pack(synonyms%name, fits)
   end subroutine usual_names

   !> Other words for a name, a blank between them; '' without any.
   pure function other_words_for(name) result(words)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: words
      integer :: i
      words = ''
      do i = 1, size(synonyms)
         if (synonyms(i)%name == name) words = trim(adjustl(synonyms(i)%words))
      end do
   end function other_words_for

end module rockdda_io_name_hints
